//! Losses, optimiser, checkpoints, logs, and the training loops.

pub mod adam;
pub mod checkpoint;
