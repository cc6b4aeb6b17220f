//! Losses, optimiser, checkpoints, logs, and the training loops.
//!
//! A window: `gan::windows` (dataset to normalised poses and log-mels) -> `gan::step` (networks, `losses`, `optim`) ->
//! a checkpoint; `gan::train` begins or goes on, `epochs` is the loop, `gan::validate` and `gan::score` choose the best.
//! `seq2seq` likewise.

pub mod epochs;
pub mod gan;
pub mod log;
pub mod no_window;
pub mod optim;
pub mod pace;
pub mod resume;
pub mod seq2seq;
