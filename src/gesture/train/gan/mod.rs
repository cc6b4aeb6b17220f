//! Training of the speech-to-gesture GAN: `windows` (data) -> `step` (networks, `losses`, optimiser) -> `validate` and
//! `score` (selection of the best checkpoint). `train` sets up the loop and prefetches the data.

pub mod augment;
pub mod average;
pub mod block_metrics;
pub mod interval_rows;
pub mod losses;
mod prefetch;
pub mod pretrained;
mod rates;
pub mod recipe;
pub mod score;
pub mod speakers;
pub mod step;
pub mod train;
pub mod validate;
pub mod windows;
pub mod words;
