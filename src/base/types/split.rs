//! The three splits of a dataset, and the time blocks of a video that belong to them.

use serde::{Deserialize, Serialize};

/// A split of the dataset. A video belongs to one split as a whole or in time blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    Train,
    /// Data that selects the best checkpoint.
    Validation,
    /// Data for the final evaluation.
    Test,
}

impl Split {
    pub const ALL: [Split; 3] = [Split::Train, Split::Validation, Split::Test];

    /// Name in file names, JSON and the configuration.
    pub const fn name(self) -> &'static str {
        match self {
            Split::Train => "train",
            Split::Validation => "validation",
            Split::Test => "test",
        }
    }
}

/// Part of a video that belongs to one split.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimeBlock {
    /// Split of the block; `None`: omitted, because another split contains the same sound.
    pub split: Option<Split>,
    pub start_secs: f64,
    /// End in seconds, exclusive.
    pub end_secs: f64,
}

impl TimeBlock {
    /// Creates a block from 0 that is longer than any video, for a video that belongs entirely to `split`.
    pub const fn entire(split: Split) -> Self {
        Self { split: Some(split), start_secs: 0.0, end_secs: f64::MAX }
    }

    pub fn secs(&self) -> f64 {
        self.end_secs - self.start_secs
    }
}
