//! Checks of the pipeline and of trained models against the synthetic speaker's ground truth.

pub mod learned;
pub mod pipeline;
pub mod positions;
pub mod sheet;
pub mod traces;
pub mod truth;
