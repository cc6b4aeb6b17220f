//! What an import is asked for, and what became of each take.

use crate::config;
use crate::dataset::import::take::TakeLimits;
use crate::dataset::info::About;
use crate::mocap::captured::Kind;
use serde::Serialize;
use std::path::PathBuf;

/// What is wanted.
#[derive(Clone, Debug)]
pub struct ImportPlan {
    pub sources: Vec<PathBuf>,
    /// Only sources of this kind; `None`: of every kind.
    pub kind: Option<Kind>,
    /// The dataset; `about.fps` and `limits.fps` agree.
    pub about: About,
    pub limits: TakeLimits,
    /// Shares of the splits, seconds of shared sound, size of shards.
    pub dataset: config::DatasetConfig,
}

/// What became of a take, or of a video of other shards.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ImportOutcome {
    pub file: String,
    /// `kept`, `refused` or `failed`.
    pub ended: &'static str,
    /// Seconds in the dataset.
    pub kept_secs: f64,
    pub reason: String,
    #[serde(rename = "says")]
    pub message: String,
}
