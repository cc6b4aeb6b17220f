//! Losses, optimiser, checkpoints, logs, and the training loops.
//!
//! The way of a window: `examples` (dataset to normalised poses and log-mels) -> `training` (a step: networks,
//! `representation`, `losses`, `adam`) -> `checkpoint`; `gan` is the loop around it, `validate` and `score` choose the
//! best. `speaker` is what a checkpoint of the generator means.

pub mod gan;
pub mod lifter;
pub mod log;
pub mod optim;
pub mod scene;
pub mod space;
pub mod supervised;
