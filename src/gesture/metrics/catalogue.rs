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

/// Number of diagnostics at the start of the cheap sums: predicted joints that are not finite, frames of another frame
/// rate.
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

    /// Sums of one interval, in total and in blocks of about `n_frames` frames. Windows that start in a block are
    /// counted there, even if they extend beyond it, so that the blocks add up to the total and no value depends on
    /// their length.
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

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array3, ArrayView3, array, s};
    use orator_base::types::skeleton::N_JOINTS;

    const CONVENTIONS: [Convention; 6] = {
        use Convention::{Aist, Emage, Genea, Orator, Speech2gesture, Trimodal};
        [Orator, Speech2gesture, Genea, Emage, Trimodal, Aist]
    };

    /// Two pseudo-random motions, [T, 49, 3].
    fn motions(n_frames: usize) -> (Array3<f32>, Array3<f32>) {
        let ground_truth = Array3::from_shape_fn((n_frames, N_JOINTS, 3), |(t, joint, k)| {
            ((t * 7919 + joint * 104_729 + k * 611_953) % 1009) as f32 / 1009.0 - 0.5
        });
        let predicted = ground_truth.mapv(|v| v * v - 0.1);
        (predicted, ground_truth)
    }

    /// Interval of [predicted, ground truth] at 15 fps.
    fn interval<'a>(
        [predicted, ground_truth]: [ArrayView3<'a, f32>; 2],
        mask: ArrayView2<'a, bool>,
        onsets: Option<&'a [f64]>,
    ) -> MotionPair<'a> {
        MotionPair { predicted, ground_truth, mask, fps: FrameRate::new(15, 1), onsets }
    }

    fn measured(catalogue: &Catalogue, frames: std::ops::Range<usize>) -> MetricSums {
        let (predicted, ground_truth) = motions(120);
        let mask = Array2::from_elem((120, N_JOINTS), true);
        let joints = [predicted.slice(s![frames.clone(), .., ..]), ground_truth.slice(s![frames.clone(), .., ..])];
        catalogue.measure(&interval(joints, mask.slice(s![frames, ..]), Some(&[0.3, 1.7, 2.5])))
    }

    /// Motion of the reference script.
    fn moving(predicted: bool) -> Array3<f32> {
        let kind = f64::from(u8::from(predicted));
        Array3::from_shape_fn((90, N_JOINTS, 3), |(t, joint, k)| {
            if joint == 0 {
                return 0.0;
            }
            let hash = ((joint * 7919 + k * 104_729) % 1009) as f64 / 1009.0;
            let (t, phase) = (t as f64, (joint + k) as f64);
            let position = hash - 0.5
                + 0.08 * (t * (0.07 + 0.05 * hash + 0.01 * kind) + 6.0 * hash).sin()
                + 0.02 * (0.9 * t + joint as f64).sin();
            (if predicted { 1.1 * position + 0.03 * (0.4 * t + phase).cos() } else { position }) as f32
        })
    }

    #[test]
    fn values_match_the_reference_script() {
        let golden: serde_json::Value =
            serde_json::from_str(include_str!("../../../fixtures/reference/metrics_golden.json")).unwrap();
        let onsets: Vec<f64> = serde_json::from_value(golden["motion"]["onsets"].clone()).unwrap();
        let (predicted, ground_truth) = (moving(true), moving(false));
        let mask = Array2::from_elem((90, N_JOINTS), true);
        for convention in CONVENTIONS {
            let known = &golden["motion"]["known"];
            let name = serde_json::to_value(convention).unwrap();
            let known = if convention == Convention::Orator { known } else { &known[name.as_str().unwrap()] };
            let catalogue = Catalogue::new(&MetricSettings { convention, ..MetricSettings::default() }).unwrap();
            let interval = interval([predicted.view(), ground_truth.view()], mask.view(), Some(&onsets));
            let measured = catalogue.measure_blocks(&interval, 20);
            let mut added = MetricSums::default();
            measured.blocks.iter().for_each(|block| added += block);
            let values = catalogue.values(&measured.total);
            for (label, known) in known.as_object().into_iter().flatten().filter(|(_, v)| v.is_number()) {
                let label_of = |d: &Definition| format!("{} {}", d.name, d.part);
                let i = catalogue.definitions().iter().position(|d| label_of(d) == *label).expect(label);
                let (found, known) = (values[i], known.as_f64().unwrap());
                assert!((found - known).abs() < 1e-5 * known, "{convention:?} {label}: {found}, known {known}");
            }
            for ((whole, added), definition) in values.iter().zip(catalogue.values(&added)).zip(catalogue.definitions())
            {
                let same = (whole - added).abs() <= 1e-3 * whole.abs() || (whole.is_nan() && added.is_nan());
                assert!(same, "{}: {whole} {added}", definition.label());
            }
        }
    }

    /// Whether two values agree: equal up to rounding, or both NaN.
    fn same(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-9 * a.abs().max(1e-6) || (a.is_nan() && b.is_nan())
    }

    #[test]
    fn drawing_blocks_equals_adding_them() {
        let catalogue = Catalogue::new(&MetricSettings::default()).unwrap();
        let blocks = [measured(&catalogue, 0..60), measured(&catalogue, 60..120)];
        let mut sums = blocks[0].clone();
        sums += &blocks[1];
        sums += &blocks[0];
        let counts = array![[1.0, 0.0], [2.0, 1.0]];
        let (cheap, costly) =
            (catalogue.draw_cheap(&blocks, counts.view()), catalogue.draw_costly(&blocks, counts.view()));
        assert_eq!(cheap.dim(), (2, catalogue.definitions().len()));
        for (i, value) in catalogue.values(&sums).into_iter().enumerate() {
            let drawn = if catalogue.is_costly(i) { &costly } else { &cheap }[[1, i]];
            assert!(same(drawn, value), "{}: {drawn} {value}", catalogue.definitions()[i].label());
        }
        let alone = catalogue.values(&blocks[0]);
        assert!((0..alone.len()).filter(|i| !catalogue.is_costly(*i)).all(|i| same(alone[i], cheap[[0, i]])));
    }

    #[test]
    fn hashes_are_unique_and_invalid_settings_are_rejected() {
        let catalogue = Catalogue::new(&MetricSettings { with_neck: true, ..MetricSettings::default() }).unwrap();
        let hashes: std::collections::BTreeSet<_> = catalogue.definitions().iter().map(Definition::hash).collect();
        assert_eq!(hashes.len(), catalogue.definitions().len());
        assert!(Catalogue::new(&MetricSettings { alphas: vec![0.0], ..MetricSettings::default() }).is_err());
        for i in 0..catalogue.definitions().len() {
            let needs = catalogue.definitions()[i].better == Better::NearerTruth;
            assert_eq!(catalogue.truth_of(i).is_some(), needs, "{}", catalogue.definitions()[i].label());
        }
    }

    #[test]
    fn a_predicted_joint_that_is_not_finite_is_reported() {
        let catalogue = Catalogue::new(&MetricSettings::default()).unwrap();
        let (mut predicted, ground_truth) = motions(30);
        predicted[[3, 20, 1]] = f32::NAN;
        let mask = Array2::from_elem((30, N_JOINTS), true);
        let interval = interval([predicted.view(), ground_truth.view()], mask.view(), None);
        let sums = catalogue.measure(&interval);
        let of = |name, part| catalogue.definitions().iter().position(|d| (d.name, d.part) == (name, part)).unwrap();
        let values = catalogue.values(&sums);
        assert!(values[of("pck_3d", "all")].is_finite());
        assert!(values[of("mpjpe", "body")].is_finite());
        assert!(values[of("mpjpe", "hands")].is_nan());
        assert!(catalogue.reason(&sums, of("mpjpe", "hands")).contains("1 predicted joints"));
        let nothing = catalogue.measure(&MotionPair { mask: mask.slice(s![..0, ..]), ..interval });
        assert!(catalogue.values(&nothing).iter().all(|value| value.is_nan()));
        assert!(catalogue.reason(&nothing, 0).contains("no joint"));
        let other = catalogue.measure(&MotionPair { fps: FrameRate::new(30, 1), ..interval });
        assert!(catalogue.values(&other).iter().all(|value| value.is_nan()));
    }

    #[test]
    fn hidden_joints_do_not_affect_values() {
        // The left hand is hidden for a second, and the right wrist in some frames.
        let mask = Array2::from_shape_fn((90, N_JOINTS), |(t, joint)| {
            !((20..35).contains(&t) && (7..28).contains(&joint) || t % 40 == 13 && joint == 3)
        });
        for convention in CONVENTIONS {
            let catalogue = Catalogue::new(&MetricSettings { convention, ..MetricSettings::default() }).unwrap();
            assert!(catalogue.definitions().iter().all(|of| !of.formula.is_empty() && !of.undefined.is_empty()));
            let [first, second] = [f32::NAN, 7.0].map(|hidden| {
                let [predicted, ground_truth] = [true, false].map(|predicted| {
                    let mut joints = moving(predicted);
                    joints
                        .indexed_iter_mut()
                        .filter(|((t, joint, _), _)| !mask[[*t, *joint]])
                        .for_each(|(_, v)| *v = hidden);
                    joints
                });
                let onsets: &[f64] = &[0.35, 1.4, 2.2, 3.3, 4.4];
                let joints = [predicted.view(), ground_truth.view()];
                catalogue.values(&catalogue.measure(&interval(joints, mask.view(), Some(onsets))))
            });
            for ((a, b), definition) in first.iter().zip(&second).zip(catalogue.definitions()) {
                assert!(same(*a, *b), "{convention:?} {}: {a} {b}", definition.label());
                // These metrics have too few frames, or too few consecutive ones.
                let few = definition.name == "frechet_embedding"
                    || definition.name == "cca" && convention == Convention::Genea;
                assert!(a.is_finite() || few, "{convention:?} {}: {a}", definition.label());
            }
        }
    }
}
