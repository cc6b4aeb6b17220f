//! The three parts of a dataset, and the stretches of a video that belong to them.

use serde::{Deserialize, Serialize};

/// A part of the dataset. A video belongs to one of them as a whole, or in blocks of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// Videos to learn from.
    Train,
    /// Videos that choose the best checkpoint.
    Validation,
    /// Videos for the final measurement.
    Test,
}

impl Split {
    /// Every split.
    pub const ALL: [Split; 3] = [Split::Train, Split::Validation, Split::Test];

    /// The name in file names, JSON and the configuration.
    pub const fn name(self) -> &'static str {
        match self {
            Split::Train => "train",
            Split::Validation => "validation",
            Split::Test => "test",
        }
    }
}

/// Stretch of a video that belongs to one split.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimeBlock {
    /// Split; `None`: left out, since another split has the same sound.
    pub split: Option<Split>,
    /// First second.
    pub start_secs: f64,
    /// Last second, exclusive.
    pub end_secs: f64,
}

impl TimeBlock {
    /// Block from 0 that no video outlasts: a video that is in `split` as a whole.
    pub const fn whole(split: Split) -> Self {
        Self { split: Some(split), start_secs: 0.0, end_secs: f64::MAX }
    }

    /// Duration.
    pub fn secs(&self) -> f64 {
        self.end_secs - self.start_secs
    }
}
