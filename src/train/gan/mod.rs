//! Training of the speech-to-gesture GAN: `windows` (data) -> `step` (networks, `losses`, optimiser) -> `validate` and
//! `score` (which checkpoint is best); `train` is the loop.

pub mod augment;
pub mod average;
pub mod begin;
pub mod block_metrics;
pub mod joined_windows;
pub mod losses;
pub mod recipe;
pub mod score;
pub mod speakers;
pub mod start;
pub mod step;
pub mod train;
pub mod validate;
pub mod windows;
