//! A stretch of frames worth keeping, and why a stretch was not.

use serde::{Deserialize, Serialize};

/// Frames `start..end` of a video at the dataset rate: continuous motion of the one speaker with its sound.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Interval {
    pub start: usize,
    pub end: usize,
}

impl Interval {
    /// Number of frames.
    pub fn n_frames(&self) -> usize {
        self.end.saturating_sub(self.start)
    }
}
