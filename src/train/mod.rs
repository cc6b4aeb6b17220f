//! Losses, optimiser, checkpoints, logs, and the training loops.
//!
//! The way of a window: `examples` (dataset to normalised poses and log-mels) -> `training` (a step: networks,
//! `representation`, `losses`, `adam`) -> `checkpoint`; `gan` is the loop around it, `validate` and `score` choose the
//! best. `speaker` is what a checkpoint of the generator means.

pub mod adam;
mod adam_composed;
pub mod body_errors;
pub mod body_motion;
pub mod body_scene;
pub mod checkpoint;
pub mod embedding;
pub mod events;
pub mod examples;
pub mod gan;
pub mod hand_motion;
pub mod hand_scene;
pub mod hand_shape;
pub mod lifter;
pub mod lifter_body;
pub mod lifter_hands;
pub mod lifter_heatmaps;
pub mod log;
pub mod losses;
pub mod motion_basis;
pub mod motion_corpus;
pub mod poses;
pub mod representation;
pub mod score;
pub mod speaker;
pub mod training;
pub mod validate;
