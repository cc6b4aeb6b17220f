//! Speech to motion.

pub(crate) mod architecture;
pub(crate) mod generate;
pub(crate) mod generate_audio;
pub(crate) mod generate_batch;
pub(crate) mod generate_sequence;
pub(crate) mod normalisation;
pub(crate) mod onnx_export;
pub(crate) mod transcripts;
mod unit;
pub(crate) mod variants;
