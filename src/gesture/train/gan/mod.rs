//! Training of the speech-to-gesture GAN: `windows` (data) -> `step` (networks, `losses`, optimiser) -> `validate` and
//! `score` (which checkpoint is best); `train` is the loop, to which `batches` are read ahead.

pub mod augment;
pub mod average;
pub mod batches;
pub mod begin;
pub mod block_metrics;
pub mod interval_rows;
pub mod losses;
pub mod recipe;
pub mod score;
pub mod speakers;
pub mod start;
pub mod step;
pub mod train;
pub mod validate;
pub mod windows;
