//! Hours of a speaker whose motion follows from its sound by a known rule, and baselines for it.

pub mod dataset;
pub mod listener;
pub mod ridge;
pub mod rule;
