//! How good made motion is beside the real one: pure functions of joints [T, 49, 3] in metres with a mask [T, 49] of
//! the real joints that were seen. Every figure is a sum that merges, so that it can be resampled; what to compare
//! with what is not said here.

pub mod basis;
pub mod embedding;
pub mod energy;
pub mod fixed_rate;
pub mod frechet;
pub mod pck;
pub mod spectrum;
