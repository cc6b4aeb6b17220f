//! Request and outcome of an import.

use crate::config;
use crate::import::take::TakeLimits;
use crate::info::About;
use orator_formats::mocap::captured::MotionKind;
use serde::Serialize;
use std::path::PathBuf;

/// Request of an import.
#[derive(Clone, Debug)]
pub struct ImportPlan {
    pub sources: Vec<PathBuf>,
    /// Kind of the sources to import; `None`: every kind.
    pub kind: Option<MotionKind>,
    /// Description of the dataset; `about.fps` equals `limits.fps`.
    pub about: About,
    pub limits: TakeLimits,
    /// Shares of the splits, seconds of shared sound, size of shards.
    pub dataset: config::DatasetConfig,
}

/// Outcome of a take, or of a video of other shards.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ImportOutcome {
    pub file: String,
    /// One of `kept`, `refused`, `failed`.
    pub ended: &'static str,
    /// Seconds in the dataset.
    pub kept_secs: f64,
    pub reason: String,
    #[serde(rename = "says")]
    pub message: String,
}
