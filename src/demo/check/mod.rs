//! What the pipeline and a trained model made of the synthetic speaker, held against the truth.

pub mod disturbed;
pub mod learned;
pub mod pipeline;
pub mod sheet;
pub mod traces;
