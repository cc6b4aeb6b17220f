//! Speech to motion.

pub mod generate;
pub mod generate_batch;
pub mod generate_sequence;
pub mod generate_sounds;
pub mod takes;
