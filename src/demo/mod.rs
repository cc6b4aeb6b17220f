//! Synthetic speakers with known joints, the embedded demo and the end-to-end test of the pipeline.
//!
//! `drawn`: `speech` -> `gesture` -> `figure` (joints) -> `camera` -> `paint` (one colour for each joint). `people`:
//! rendered people in rooms, one of them the demo's `host`, who says more in `more_speech`; `labels`: pictures with labels. `rule`: hours of
//! speech and motion by a known rule, as a dataset. `check`: the results of the pipeline and of trained models against
//! the truth.

pub mod check;
pub mod drawn;
pub mod host;
pub mod labels;
pub mod more_speech;
pub mod people;
pub mod rule;
pub mod spoken_video;

pub use check::pipeline::GENERATOR;
