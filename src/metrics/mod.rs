//! How good made motion is beside the real one: pure functions of joints [T, 49, 3] in metres with a mask [T, 49] of
//! the real joints that were seen. Every figure is a sum that merges, so that it can be resampled; what to compare
//! with what is not said here. `catalogue` is the way in: it lists all figures with their definitions, measures intervals and
//! reads values off their sums.

mod acceleration_error;
pub mod basis;
mod beat_aist;
mod beat_angles;
pub mod beats;
mod bones;
pub mod catalogue;
mod cca;
pub mod convention;
mod definition;
mod derivatives;
mod diversity;
pub mod embedding;
pub mod energy;
pub mod fixed_rate;
pub mod frechet;
mod frechet_sums;
mod hellinger;
mod interval;
mod l1;
mod mean;
mod moments;
mod mpjpe;
mod pairwise;
pub mod part;
pub mod pck;
mod procrustes_error;
pub mod spectrum;
mod sums;
