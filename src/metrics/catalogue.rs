//! Which numbers there are, under which convention, and the two steps to each: measure every interval (sums that add),
//! then read the values off any sum of intervals. A metric's own arithmetic is in its own file.

use super::definition::Metric;
use super::interval::Pair;
use super::part::Part;
use super::pck::Axes;
use super::{l1, mpjpe, pck, sums};
use crate::types::time::FrameRate;
use anyhow::ensure;
use ndarray::{Array2, ArrayView2};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub use super::definition::{Better, Definition};
pub use super::interval::Interval;
pub use super::sums::Sums;

/// Whose definitions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Convention {
    /// This project's own.
    #[default]
    Orator,
    Speech2gesture,
    Genea,
    Emage,
    Trimodal,
    Aist,
}

/// What the numbers are set to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Settings {
    pub convention: Convention,
    /// Shares of the pose's largest extent for PCK, each > 0.
    pub alphas: Vec<f64>,
    /// Frame rate of all motion.
    pub fps: FrameRate,
    /// Whether errors and speeds are also given over 49 joints, the neck included.
    pub with_neck: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { convention: Convention::default(), alphas: vec![0.2, 0.1], fps: FrameRate::new(15, 1), with_neck: false }
    }
}

/// All numbers of one convention.
pub struct Catalogue {
    metrics: Vec<Box<dyn Metric>>,
    definitions: Vec<Definition>,
    fps: FrameRate,
}

impl Catalogue {
    /// Errors: an alpha that is not above 0.
    pub fn new(settings: &Settings) -> anyhow::Result<Self> {
        for alpha in &settings.alphas {
            ensure!(
                alpha.is_finite() && *alpha > 0.0,
                "alpha of PCK is {alpha}, expected a number above 0, such as 0.2"
            );
        }
        let metrics = metrics(settings);
        let mut definitions: Vec<_> = metrics.iter().flat_map(|metric| metric.definitions()).collect();
        for definition in &mut definitions {
            definition.parameters["convention"] = serde_json::to_value(settings.convention)?;
            definition.parameters["fps"] = settings.fps.per_sec().into();
        }
        Ok(Self { metrics, definitions, fps: settings.fps })
    }

    /// What `values` gives, in order.
    pub fn definitions(&self) -> &[Definition] {
        &self.definitions
    }

    /// Whether definition `index` is of those for which few draws are taken.
    pub fn is_costly(&self, index: usize) -> bool {
        self.costly().get(index).copied().unwrap_or(false)
    }

    /// For a figure that should be near the real motion's: the index of that figure of the real motion.
    pub fn truth_of(&self, index: usize) -> Option<usize> {
        let of = self.definitions.get(index).filter(|definition| definition.better == Better::NearerTruth)?;
        let name = format!("{}_of_real", of.name);
        self.definitions.iter().position(|other| other.name == name && other.part == of.part)
    }

    /// The sums of one interval. Frames beyond the shortest of its arrays are not looked at. An interval of another
    /// frame rate than the settings' makes every value NaN.
    pub fn measure(&self, interval: &Interval) -> Sums {
        let pair = Pair::new(interval);
        let mut sums = Sums { cheap: vec![pair.n_broken() as f64, pair.n_frames() as f64], costly: Vec::new() };
        for metric in &self.metrics {
            let mut own = vec![if interval.fps == self.fps { 0.0 } else { f64::NAN }; metric.n_sums()];
            metric.measure(&pair, &mut own);
            if metric.is_costly() { &mut sums.costly } else { &mut sums.cheap }.append(&mut own);
        }
        sums
    }

    /// One value a definition; NaN where undefined.
    pub fn values(&self, sums: &Sums) -> Vec<f64> {
        self.read(Some(&sums.cheap), Some(&sums.costly))
    }

    /// The same, with NaN in place of every costly value.
    pub fn cheap_values(&self, sums: &Sums) -> Vec<f64> {
        self.read(Some(&sums.cheap), None)
    }

    /// The same, with NaN in place of every value that is not costly.
    pub fn costly_values(&self, sums: &Sums) -> Vec<f64> {
        self.read(None, Some(&sums.costly))
    }

    /// Values [n_draws, n_definitions] of draws of blocks with replacement, NaN in place of costly ones. `counts`
    /// [n_draws, n_blocks]: how often each block was drawn. Much faster than adding `Sums` one by one.
    pub fn draw_cheap(&self, blocks: &[Sums], counts: ArrayView2<f64>) -> Array2<f64> {
        let drawn = sums::draw_cheap(blocks, counts);
        self.rows(drawn.outer_iter().map(|row| row.to_vec()).collect(), |row| self.read(Some(row), None))
    }

    /// The same of costly values, NaN in place of the others.
    pub fn draw_costly(&self, blocks: &[Sums], counts: ArrayView2<f64>) -> Array2<f64> {
        let drawn = sums::draw_costly(blocks, counts);
        self.rows(drawn.outer_iter().map(|row| row.to_vec()).collect(), |row| self.read(None, Some(row)))
    }

    /// Why value `index` of these sums is NaN.
    pub fn reason(&self, sums: &Sums, index: usize) -> String {
        match sums.cheap.first() {
            Some(n_broken) if *n_broken > 0.0 => {
                format!("{n_broken} joints of the made motion are not finite where the real ones are seen")
            }
            Some(_) => self.definitions.get(index).map_or("", |definition| definition.undefined).to_owned(),
            None => "nothing was measured".to_owned(),
        }
    }

    fn rows(&self, rows: Vec<Vec<f64>>, read: impl Fn(&[f64]) -> Vec<f64> + Sync) -> Array2<f64> {
        let values: Vec<f64> = rows.par_iter().flat_map_iter(|row| read(row)).collect();
        // as many as asked for, by construction
        Array2::from_shape_vec((rows.len(), self.definitions.len()), values).unwrap_or_default()
    }

    fn read(&self, cheap: Option<&[f64]>, costly: Option<&[f64]>) -> Vec<f64> {
        let (mut at_cheap, mut at_costly) = (2, 0);
        let mut values = Vec::with_capacity(self.definitions.len());
        for metric in &self.metrics {
            let (row, at) = if metric.is_costly() { (costly, &mut at_costly) } else { (cheap, &mut at_cheap) };
            let own = row.and_then(|row| row.get(*at..*at + metric.n_sums()));
            *at += metric.n_sums();
            match own {
                Some(own) => values.extend(metric.values(own)),
                None => values.extend(metric.definitions().iter().map(|_| f64::NAN)),
            }
        }
        values
    }

    fn costly(&self) -> Vec<bool> {
        self.metrics.iter().flat_map(|metric| metric.definitions().into_iter().map(|_| metric.is_costly())).collect()
    }
}

fn metrics(settings: &Settings) -> Vec<Box<dyn Metric>> {
    let mut all: Vec<Box<dyn Metric>> =
        vec![pck::metric(&[Axes::Xyz, Axes::Xy], &[Part::All, Part::Body, Part::Hands], &settings.alphas)];
    let mut parts = vec![Part::All, Part::Body, Part::Hands, Part::Wrists, Part::FingersFromWrist];
    if settings.with_neck {
        parts.push(Part::WithNeck);
    }
    all.extend(parts.iter().map(|part| l1::metric(*part)));
    all.extend(parts.iter().map(|part| mpjpe::metric(*part)));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::types::skeleton::N_JOINTS;
    use ndarray::{Array3, array, s};

    /// Two motions without meaning, [T, 49, 3].
    fn motions(n_frames: usize) -> (Array3<f32>, Array3<f32>) {
        let real = Array3::from_shape_fn((n_frames, N_JOINTS, 3), |(t, joint, k)| {
            ((t * 7919 + joint * 104_729 + k * 611_953) % 1009) as f32 / 1009.0 - 0.5
        });
        let made = real.mapv(|v| v * v - 0.1);
        (made, real)
    }

    fn measured(catalogue: &Catalogue, frames: std::ops::Range<usize>) -> Sums {
        let (made, real) = motions(120);
        let mask = Array2::from_elem((120, N_JOINTS), true);
        catalogue.measure(&Interval {
            made: made.slice(s![frames.clone(), .., ..]),
            real: real.slice(s![frames.clone(), .., ..]),
            mask: mask.slice(s![frames, ..]),
            fps: FrameRate::new(15, 1),
            onsets: Some(&[0.3, 1.7, 2.5]),
        })
    }

    /// The same number, or both not one.
    fn same(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-9 * a.abs().max(1e-6) || (a.is_nan() && b.is_nan())
    }

    #[test]
    fn drawing_blocks_is_adding_them() {
        let catalogue = Catalogue::new(&Settings::default()).unwrap();
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
        let alone = catalogue.cheap_values(&blocks[0]);
        assert!(alone.iter().zip(cheap.row(0)).all(|(a, b)| same(*a, *b)));
    }

    #[test]
    fn every_figure_is_another_and_a_wrong_setting_is_told() {
        let catalogue = Catalogue::new(&Settings { with_neck: true, ..Settings::default() }).unwrap();
        let hashes: std::collections::BTreeSet<_> = catalogue.definitions().iter().map(Definition::hash).collect();
        assert_eq!(hashes.len(), catalogue.definitions().len());
        assert!(Catalogue::new(&Settings { alphas: vec![0.0], ..Settings::default() }).is_err());
        for i in 0..catalogue.definitions().len() {
            let needs = catalogue.definitions()[i].better == Better::NearerTruth;
            assert_eq!(catalogue.truth_of(i).is_some(), needs, "{}", catalogue.definitions()[i].label());
        }
    }

    #[test]
    fn a_made_joint_that_is_not_finite_is_told() {
        let catalogue = Catalogue::new(&Settings::default()).unwrap();
        let (mut made, real) = motions(30);
        made[[3, 20, 1]] = f32::NAN;
        let mask = Array2::from_elem((30, N_JOINTS), true);
        let interval = Interval {
            made: made.view(),
            real: real.view(),
            mask: mask.view(),
            fps: FrameRate::new(15, 1),
            onsets: None,
        };
        let sums = catalogue.measure(&interval);
        let of = |name, part| catalogue.definitions().iter().position(|d| (d.name, d.part) == (name, part)).unwrap();
        let values = catalogue.values(&sums);
        assert!(values[of("pck_3d", "all")].is_finite());
        assert!(values[of("mpjpe", "body")].is_finite());
        assert!(values[of("mpjpe", "hands")].is_nan());
        assert!(catalogue.reason(&sums, of("mpjpe", "hands")).contains("1 joints of the made motion"));
        let nothing = catalogue.measure(&Interval { mask: mask.slice(s![..0, ..]), ..interval });
        assert!(catalogue.values(&nothing).iter().all(|value| value.is_nan()));
        assert!(catalogue.reason(&nothing, 0).contains("no joint"));
        let other = catalogue.measure(&Interval { fps: FrameRate::new(30, 1), ..interval });
        assert!(catalogue.values(&other).iter().all(|value| value.is_nan()));
    }
}
