//! The three parts of a dataset.

use serde::{Deserialize, Serialize};

/// A part of the dataset. A video belongs to one of them as a whole.
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
