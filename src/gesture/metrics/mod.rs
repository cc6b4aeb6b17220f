//! How good predicted motion is beside the ground truth: pure functions of joints [T, 49, 3] in metres with a mask [T, 49] of
//! the real joints that were seen. Every metric is a sum that merges, so that it can be resampled; what to compare
//! with what is not said here. `catalogue` is the way in: it lists all metrics with their definitions, measures intervals and
//! reads values off their sums.

pub mod beat;
pub mod body_part;
pub mod catalogue;
pub mod convention;
pub mod definition;
pub mod distribution;
pub mod movement;
pub mod pair;
pub mod per_frame;
pub mod position;
pub mod settings;
pub mod space;
pub mod sums;
