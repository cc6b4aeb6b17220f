//! Accepted runs of frames.

use super::time::FrameRate;
use serde::{Deserialize, Serialize};

/// Frames `start..end` of a video at the dataset rate: continuous motion of one speaker, with sound.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Interval {
    pub start: usize,
    pub end: usize,
}

impl Interval {
    pub fn n_frames(&self) -> usize {
        self.end.saturating_sub(self.start)
    }

    /// Number of windows of `n_frames` that start every `stride` frames; with `stride == n_frames` they are adjacent.
    pub const fn n_windows(self, n_frames: usize, stride: usize) -> usize {
        let length = self.end.saturating_sub(self.start);
        if n_frames == 0 || stride == 0 || length < n_frames { 0 } else { (length - n_frames) / stride + 1 }
    }
}

/// Intervals of a video as stored in `intervals.json`: sorted and disjoint.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Intervals {
    pub fps: FrameRate,
    pub n_frames: usize,
    pub intervals: Vec<Interval>,
    pub windows_64: Windows64,
    /// Parts of the intervals in which the hands rest on each other; the hidden joints are filled in and masked.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub resting: Vec<Interval>,
}

/// Numbers of windows of 64 frames over all intervals: with a stride of 5 frames, and without overlap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Windows64 {
    pub stride_5: usize,
    #[serde(rename = "apart")]
    pub disjoint: usize,
}

impl Intervals {
    /// Creates the intervals and counts their windows.
    pub fn new(fps: FrameRate, n_frames: usize, intervals: Vec<Interval>) -> Self {
        let count = |stride| intervals.iter().map(|interval| interval.n_windows(64, stride)).sum();
        let windows_64 = Windows64 { stride_5: count(5), disjoint: count(64) };
        Self { fps, n_frames, intervals, windows_64, resting: Vec::new() }
    }

    /// Sets `resting` to the parts of the given intervals that overlap the accepted ones.
    #[must_use]
    pub fn with_resting(mut self, resting: &[Interval]) -> Self {
        let part = |interval: &Interval, rest: &Interval| Interval {
            start: interval.start.max(rest.start),
            end: interval.end.min(rest.end),
        };
        let parts = self.intervals.iter().flat_map(|interval| resting.iter().map(move |rest| part(interval, rest)));
        self.resting = parts.filter(|part| part.n_frames() > 0).collect();
        self
    }

    /// Intervals in which the hands rest, as (start, end) in seconds.
    pub fn resting_intervals(&self) -> impl Iterator<Item = (f64, f64)> {
        self.resting.iter().map(|rest| (self.fps.secs(rest.start), self.fps.secs(rest.end)))
    }

    /// Total duration in seconds in which the hands rest.
    pub fn resting_secs(&self) -> f64 {
        self.resting.iter().map(|rest| self.fps.secs(rest.n_frames())).sum()
    }
}
