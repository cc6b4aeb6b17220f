//! Metrics and evaluation.

pub(crate) mod calibration;
pub(crate) mod catalogue;
pub(crate) mod derivatives;
pub(crate) mod evaluate_checkpoints;
pub(crate) mod evaluate_files;
pub(crate) mod evaluate_speaker;
pub(crate) mod frechet;
pub(crate) mod frechet_response;
pub(crate) mod gesture_phases;
pub(crate) mod golden_metrics;
pub(crate) mod metrics;
pub(crate) mod motion_store;
pub(crate) mod pairs;
pub(crate) mod predictor;
mod unit;
