//! The catalogue of all metrics of a convention, and their computation in two steps: measuring every interval as
//! additive sums, and computing values from the sum of any intervals. The arithmetic of each metric is in its own file.

use super::definition::MetricFamily;
use super::pair::PairedFrames;
use super::settings::{self, MetricSettings};
use super::sums::{self, BlockSums, CostlySums};
use anyhow::ensure;
use ndarray::{Array2, ArrayView2};
use orator_base::types::time::FrameRate;
use rayon::prelude::*;

pub use super::definition::{Better, Definition};
pub use super::pair::MotionPair;
pub use super::settings::Convention;
pub use super::sums::MetricSums;

/// Number of diagnostics at the start of the cheap sums: predicted joints that are not finite, frames at another rate.
const N_DIAGNOSTICS: usize = 2;

pub struct Catalogue {
    metrics: Vec<MetricFamily>,
    definitions: Vec<Definition>,
    fps: FrameRate,
}

#[derive(Clone, Debug, Default)]
pub struct IntervalSums {
    pub total: MetricSums,
    pub blocks: Vec<MetricSums>,
}

/// Number of equal blocks of about `length` frames into which `n_frames` are divided, at least 1.
pub fn n_blocks(n_frames: usize, length: usize) -> usize {
    ((n_frames as f64 / length.max(1) as f64).round() as usize).max(1)
}

impl Catalogue {
    /// Catalogue of the metrics for these settings.
    ///
    /// # Errors
    /// An alpha that is not a positive number.
    pub fn new(settings: &MetricSettings) -> anyhow::Result<Self> {
        for alpha in &settings.alphas {
            ensure!(
                alpha.is_finite() && *alpha > 0.0,
                "invalid alpha {alpha} of PCK: expected a number > 0, such as 0.2"
            );
        }
        let metrics = settings::metrics(settings);
        let mut definitions: Vec<Definition> = metrics.iter().flat_map(|metric| metric.definitions.clone()).collect();
        for definition in &mut definitions {
            definition.parameters["convention"] = serde_json::to_value(settings.convention)?;
            definition.parameters["fps"] = settings.fps.per_sec().into();
        }
        Ok(Self { metrics, definitions, fps: settings.fps })
    }

    /// Definitions of `values`, in the same order.
    pub fn definitions(&self) -> &[Definition] {
        &self.definitions
    }

    /// Whether definition `index` is costly to compute, so that fewer draws are taken.
    pub fn is_costly(&self, index: usize) -> bool {
        let mut of_each = self.metrics.iter().flat_map(|metric| metric.definitions.iter().map(|_| metric.is_costly));
        of_each.nth(index) == Some(true)
    }

    /// Index of the ground truth's metric for a metric that is better the nearer it is to it (`Better::NearerTruth`).
    pub fn truth_of(&self, index: usize) -> Option<usize> {
        let of = self.definitions.get(index).filter(|definition| definition.better == Better::NearerTruth)?;
        let name = format!("{}_of_real", of.name);
        self.definitions.iter().position(|other| other.name == name && other.part == of.part)
    }

    /// Sums of one interval. Frames beyond the shortest of its arrays are ignored. An interval whose frame rate differs
    /// from that of the settings makes every value NaN.
    pub fn measure(&self, interval: &MotionPair) -> MetricSums {
        self.measure_blocks(interval, usize::MAX).total
    }

    /// Sums of one interval, in total and in blocks of about `n_frames` frames. Windows are counted in the block in
    /// which they start, so that the blocks add up to the total and no value depends on their length.
    pub fn measure_blocks(&self, interval: &MotionPair, n_frames: usize) -> IntervalSums {
        let pair = PairedFrames::new(interval);
        let n = n_blocks(pair.n_frames(), n_frames);
        let mut diagnostics = BlockSums::new(n, N_DIAGNOSTICS, pair.n_frames(), 0.0);
        let other_rate = interval.fps != self.fps;
        for t in 0..pair.n_frames() {
            diagnostics.at(t)[0] += pair.n_non_finite(t) as f64;
            diagnostics.at(t)[1] += f64::from(u8::from(other_rate));
        }
        let start = if other_rate { f64::NAN } else { 0.0 };
        let measure = |metric: &MetricFamily| {
            let mut blocks = BlockSums::new(n, metric.n_sums, pair.n_frames(), start);
            (metric.measure)(&pair, &mut blocks);
            (metric.is_costly, blocks)
        };
        let of_each: Vec<_> = self.metrics.par_iter().map(measure).collect();
        let (mut cheap, mut costly) = (vec![diagnostics], Vec::new());
        for (is_costly, blocks) in of_each {
            if is_costly { &mut costly } else { &mut cheap }.push(blocks);
        }
        let row = |all: &mut [BlockSums], block| all.iter_mut().flat_map(|blocks| blocks.row(block).to_vec()).collect();
        let mut measured = IntervalSums::default();
        for block in 0..n {
            let costly = CostlySums::Added(row(&mut costly, block));
            let sums = MetricSums { cheap: row(&mut cheap, block), costly };
            measured.total += &sums;
            measured.blocks.push(sums.into_block());
        }
        measured
    }

    /// One value per definition; NaN if undefined.
    pub fn values(&self, sums: &MetricSums) -> Vec<f64> {
        self.read(Some(&sums.cheap), Some(&sums.costly.row()))
    }

    /// Values [n_draws, n_definitions] of draws of blocks with replacement, NaN for costly metrics. `counts`
    /// [n_draws, n_blocks] is the multiplicity of each block. Much faster than adding `MetricSums` one by one.
    pub fn draw_cheap(&self, blocks: &[MetricSums], counts: ArrayView2<f64>) -> Array2<f64> {
        let drawn = sums::draw_cheap(blocks, counts);
        self.rows(drawn.outer_iter().map(|row| row.to_vec()).collect(), |row| self.read(Some(row), None))
    }

    /// Values of costly metrics for draws of blocks as in [`Self::draw_cheap`], NaN for all others.
    pub fn draw_costly(&self, blocks: &[MetricSums], counts: ArrayView2<f64>) -> Array2<f64> {
        let drawn = sums::draw_costly(blocks, counts);
        self.rows(drawn.outer_iter().map(|row| row.to_vec()).collect(), |row| self.read(None, Some(row)))
    }

    /// Reason why value `index` of these sums is NaN.
    pub fn reason(&self, sums: &MetricSums, index: usize) -> String {
        match sums.cheap.get(..N_DIAGNOSTICS) {
            None => "no values were measured".to_owned(),
            Some([_, n_other]) if *n_other > 0.0 => {
                format!("{n_other} frames do not have the frame rate {}", self.fps)
            }
            Some([n_non_finite, _]) if *n_non_finite > 0.0 => {
                format!("{n_non_finite} predicted joints are not finite where the true joints are visible")
            }
            Some(_) => self.definitions.get(index).map_or("", |definition| definition.undefined).to_owned(),
        }
    }

    fn rows(&self, rows: Vec<Vec<f64>>, read: impl Fn(&[f64]) -> Vec<f64> + Sync) -> Array2<f64> {
        let values: Vec<f64> = rows.par_iter().flat_map_iter(|row| read(row)).collect();
        // `read` returns one value per definition, so the shape always fits.
        Array2::from_shape_vec((rows.len(), self.definitions.len()), values).unwrap_or_default()
    }

    fn read(&self, cheap: Option<&[f64]>, costly: Option<&[f64]>) -> Vec<f64> {
        let (mut at_cheap, mut at_costly) = (N_DIAGNOSTICS, 0);
        let mut values = Vec::with_capacity(self.definitions.len());
        for metric in &self.metrics {
            let (row, at) = if metric.is_costly { (costly, &mut at_costly) } else { (cheap, &mut at_cheap) };
            let own = row.and_then(|row| row.get(*at..*at + metric.n_sums));
            *at += metric.n_sums;
            match own {
                Some(own) => values.extend((metric.values)(own)),
                None => values.extend(metric.definitions.iter().map(|_| f64::NAN)),
            }
        }
        values
    }
}
