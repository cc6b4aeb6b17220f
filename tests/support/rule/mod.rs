//! Speakers whose motion follows from their audio, and optionally their words, by a known rule; a second rule for
//! arbitrary speech; baselines for both.

pub mod baselines;
pub mod context_ridge;
pub mod dataset;
pub mod habits;
pub mod ridge;
pub mod rule;
pub mod speech_dataset;
pub mod speech_events;
pub mod speech_gestures;
pub mod words;
