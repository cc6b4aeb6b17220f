//! Speech to motion.

pub(crate) mod generate;
pub(crate) mod generate_audio;
pub(crate) mod generate_batch;
pub(crate) mod generate_sequence;
pub(crate) mod variants;
