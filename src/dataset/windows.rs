//! Windows for training: `n_frames` frames every `stride` frames of every interval of a split, never across two.

use super::index::SampleRef;
use super::read::Dataset;
use super::split::Split;
use crate::types::interval::Interval;
use crate::types::sound::Sound;
use anyhow::{Result, ensure};
use ndarray::{Array2, Array3};

/// All windows of a split, in the order of the shards.
pub struct Windows<'a> {
    dataset: &'a Dataset,
    n_frames: usize,
    stride: usize,
    samples: Vec<SampleRef>,
    /// Number of windows before those of each sample, and at the end of all.
    before: Vec<usize>,
}

/// One window.
#[derive(Clone, Debug, PartialEq)]
pub struct Window {
    /// Key of the interval, and the window's first frame in it.
    pub key: String,
    pub start: usize,
    /// [n_frames, 49, 3], metres; NaN where missing.
    pub pose3d: Array3<f32>,
    /// [n_frames, 49]
    pub mask: Array2<bool>,
    /// `round(n_frames / fps * rate)` samples.
    pub sound: Sound,
}

impl<'a> Windows<'a> {
    /// Windows of `n_frames` every `stride` frames, both at least 1.
    pub fn new(dataset: &'a Dataset, split: Split, n_frames: usize, stride: usize) -> Result<Self> {
        ensure!(n_frames > 0 && stride > 0, "a window needs at least one frame, and a stride of at least one");
        let samples = dataset.samples(split);
        let mut before = vec![0];
        let mut total = 0;
        for sample in &samples {
            total += Interval { start: 0, end: sample.n_frames }.n_windows(n_frames, stride);
            before.push(total);
        }
        Ok(Self { dataset, n_frames, stride, samples, before })
    }

    /// Number of windows.
    pub fn len(&self) -> usize {
        self.before.last().copied().unwrap_or(0)
    }

    /// Whether no interval of the split is as long as a window.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The `i`-th window; only its own bytes are read.
    pub fn get(&self, i: usize) -> Result<Window> {
        ensure!(i < self.len(), "window {i} of {}", self.len());
        let at = self.before.partition_point(|&before| before <= i) - 1;
        let (sample, start) = (&self.samples[at], (i - self.before[at]) * self.stride);
        let motion = self.dataset.motion(sample, start..start + self.n_frames)?;
        let sound = self.dataset.sound_of_frames(sample, start, self.n_frames)?;
        Ok(Window { key: sample.key.clone(), start, pose3d: motion.joints, mask: motion.mask, sound })
    }
}
