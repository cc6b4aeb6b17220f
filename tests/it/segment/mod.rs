//! Segmentation: accepted intervals and rejected seconds.

pub(crate) mod changed_thresholds;
pub(crate) mod decisions;
pub(crate) mod rendered_voices;
pub(crate) mod segment;
pub(crate) mod speech;
mod unit;
pub(crate) mod voices;
