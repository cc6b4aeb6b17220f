//! Hours of a speaker whose motion follows from its sound, and if asked its words, by a known rule; baselines for it.

pub mod baselines;
pub mod dataset;
pub mod habits;
pub mod ridge;
pub mod rule;
pub mod words;
