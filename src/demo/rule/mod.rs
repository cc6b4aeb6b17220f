//! Hours of a speaker whose motion follows from its sound by a known rule, and baselines for it.

pub mod baselines;
pub mod dataset;
pub mod ridge;
pub mod rule;
