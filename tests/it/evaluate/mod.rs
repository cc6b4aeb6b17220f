//! Metrics and evaluation.

pub mod calibration;
pub mod evaluate_checkpoints;
pub mod evaluate_files;
pub mod evaluate_speaker;
pub mod frechet_response;
pub mod golden_metrics;
pub mod metrics;
