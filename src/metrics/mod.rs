//! How good made motion is beside the real one: pure functions of joints [T, 49, 3] in metres with a mask [T, 49] of
//! the real joints that were seen. Every figure is a sum that merges, so that it can be resampled; what to compare
//! with what is not said here. `catalogue` is the way in: it lists all figures with their definitions, measures intervals and
//! reads values off their sums.

pub mod basis;
pub mod catalogue;
mod definition;
pub mod embedding;
pub mod energy;
pub mod fixed_rate;
pub mod frechet;
mod interval;
mod l1;
mod mean;
mod mpjpe;
pub mod part;
pub mod pck;
pub mod spectrum;
mod sums;
