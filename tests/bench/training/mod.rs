//! Benchmarks of training steps.

pub(crate) mod lifter;
pub(crate) mod seq2seq;
pub(crate) mod train;
