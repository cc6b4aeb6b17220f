//! Speed of training steps.

pub mod lifter;
pub mod seq2seq;
pub mod train;
