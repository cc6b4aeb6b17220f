//! Speech to motion.

pub(crate) mod generate;
pub(crate) mod generate_batch;
pub(crate) mod generate_sequence;
pub(crate) mod generate_sounds;
pub(crate) mod takes;
