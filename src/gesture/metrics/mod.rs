//! Metrics of predicted motion against the ground truth: pure functions of joints [T, 49, 3] in metres with a mask [T,
//! 49] of the visible real joints. Every metric is computed from additive sums, so that it can be resampled; baselines
//! are not part of this module. The entry point is `catalogue`: it lists all metrics with their definitions, measures
//! intervals, and computes values from their sums.

pub mod beat;
pub mod catalogue;
pub mod definition;
pub mod distribution;
pub mod movement;
pub mod pair;
pub mod position;
pub mod settings;
pub mod space;
pub mod sums;
