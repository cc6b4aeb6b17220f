//! `stats.json`: what the numbers are like. Means and deviations come from the training split alone, from joints that
//! were seen; hours, windows and refused seconds are of everything.

use super::{STRIDE_FRAMES, WINDOW_FRAMES};
use crate::types::interval::Interval;
use crate::types::pose3d::Motion;
use crate::types::skeleton::N_JOINTS;
use ndarray::Array2;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The whole file. Rows are joints, columns x, y, z in metres; a joint never seen has zeros.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stats {
    /// Frames of the training split in which each joint was seen.
    pub n_seen: Vec<u64>,
    pub mean: Vec<[f64; 3]>,
    /// Of the population.
    pub std: Vec<[f64; 3]>,
    pub min: Vec<[f64; 3]>,
    pub max: Vec<[f64; 3]>,
    pub windows: WindowCount,
    pub footage: Footage,
}

/// Windows in each split: drawn at the training stride, and side by side without overlap.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct WindowCount {
    pub n_frames: usize,
    pub stride: usize,
    pub strided: BTreeMap<String, usize>,
    pub apart: BTreeMap<String, usize>,
}

/// What became of the speaker's footage, in seconds; `kept_secs` and `refused_secs` add up to `secs`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Footage {
    pub n_videos: usize,
    pub n_intervals: usize,
    pub secs: f64,
    pub kept_secs: f64,
    /// By reason.
    pub refused_secs: BTreeMap<String, f64>,
    /// Silence appended where the sound ended before the motion.
    pub padded_sound_secs: f64,
}

impl Stats {
    /// Mean of each joint coordinate, [49, 3], metres.
    pub fn mean(&self) -> Array2<f32> {
        table(&self.mean)
    }

    /// Standard deviation of each joint coordinate, [49, 3], metres; 0 for the neck and for joints never seen.
    pub fn std(&self) -> Array2<f32> {
        table(&self.std)
    }

    /// Whether every table has one row a joint.
    pub(super) fn is_whole(&self) -> bool {
        self.n_seen.len() == N_JOINTS
            && [&self.mean, &self.std, &self.min, &self.max].iter().all(|t| t.len() == N_JOINTS)
    }
}

fn table(rows: &[[f64; 3]]) -> Array2<f32> {
    Array2::from_shape_fn((N_JOINTS, 3), |(joint, k)| rows.get(joint).map_or(0.0, |row| row[k] as f32))
}

/// Gathers the statistics sample by sample (Welford's running mean and variance).
pub struct Gatherer {
    n_seen: Vec<u64>,
    mean: Vec<[f64; 3]>,
    squares: Vec<[f64; 3]>,
    min: Vec<[f64; 3]>,
    max: Vec<[f64; 3]>,
    windows: WindowCount,
}

impl Default for Gatherer {
    fn default() -> Self {
        let rows = |value: f64| vec![[value; 3]; N_JOINTS];
        let windows = WindowCount { n_frames: WINDOW_FRAMES, stride: STRIDE_FRAMES, ..Default::default() };
        Self {
            n_seen: vec![0; N_JOINTS],
            mean: rows(0.0),
            squares: rows(0.0),
            min: rows(f64::INFINITY),
            max: rows(f64::NEG_INFINITY),
            windows,
        }
    }
}

impl Gatherer {
    /// Counts the windows of a sample of `n_frames` frames.
    pub fn count(&mut self, split: &str, n_frames: usize) {
        let add = |counts: &mut BTreeMap<String, usize>, n| *counts.entry(split.to_owned()).or_default() += n;
        let interval = Interval { start: 0, end: n_frames };
        add(&mut self.windows.strided, interval.n_windows(WINDOW_FRAMES, STRIDE_FRAMES));
        add(&mut self.windows.apart, interval.n_windows(WINDOW_FRAMES, WINDOW_FRAMES));
    }

    /// Takes in the joints that were seen in a training sample.
    pub fn learn(&mut self, motion: &Motion) {
        for (frame, seen) in motion.joints.outer_iter().zip(motion.mask.outer_iter()) {
            for (joint, row) in frame.outer_iter().enumerate() {
                if !seen[joint] || row.iter().any(|v| !v.is_finite()) {
                    continue;
                }
                self.n_seen[joint] += 1;
                for (k, &value) in row.iter().enumerate() {
                    let (value, mean) = (f64::from(value), &mut self.mean[joint][k]);
                    let delta = value - *mean;
                    *mean += delta / self.n_seen[joint] as f64;
                    self.squares[joint][k] += delta * (value - *mean);
                    self.min[joint][k] = self.min[joint][k].min(value);
                    self.max[joint][k] = self.max[joint][k].max(value);
                }
            }
        }
    }

    /// The finished statistics.
    pub fn finish(mut self, footage: Footage) -> Stats {
        for joint in 0..N_JOINTS {
            let n = self.n_seen[joint];
            for k in 0..3 {
                self.squares[joint][k] = (self.squares[joint][k] / n.max(1) as f64).sqrt();
                if n == 0 {
                    (self.min[joint][k], self.max[joint][k]) = (0.0, 0.0);
                }
            }
        }
        Stats {
            n_seen: self.n_seen,
            mean: self.mean,
            std: self.squares,
            min: self.min,
            max: self.max,
            windows: self.windows,
            footage,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::types::time::FrameRate;
    use ndarray::{Array3, s};

    #[test]
    fn masked_and_missing_joints_have_no_say() {
        let mut joints = Array3::<f32>::zeros((4, N_JOINTS, 3));
        joints.slice_mut(s![.., 1, 0]).assign(&ndarray::arr1(&[1.0, 2.0, 6.0, 1000.0]));
        joints.slice_mut(s![.., 2, ..]).fill(f32::NAN);
        let mut mask = Array2::from_elem((4, N_JOINTS), true);
        mask[[3, 1]] = false;
        let mut gatherer = Gatherer::default();
        gatherer.learn(&Motion { fps: FrameRate::new(15, 1), joints, mask });
        gatherer.count("train", 69);
        let stats = gatherer.finish(Footage::default());
        assert_eq!((stats.n_seen[1], stats.n_seen[2], stats.n_seen[0]), (3, 0, 4));
        assert!((stats.mean[1][0] - 3.0).abs() < 1e-12);
        assert!((stats.std[1][0] - (14.0f64 / 3.0).sqrt()).abs() < 1e-12);
        assert_eq!((stats.min[1][0], stats.max[1][0]), (1.0, 6.0));
        assert_eq!((stats.mean[2], stats.std[2], stats.min[2]), ([0.0; 3], [0.0; 3], [0.0; 3]));
        assert_eq!((stats.windows.strided["train"], stats.windows.apart["train"]), (2, 1));
        assert!(stats.is_whole());
    }
}
