//! Hours of a speaker whose motion follows from its sound, and if asked its words, by a known rule; a second rule for any speech; baselines for both.

pub mod baselines;
pub mod dataset;
pub mod habits;
pub mod ridge;
pub mod ridge_listener;
pub mod rule;
pub mod speech_dataset;
pub mod speech_events;
pub mod speech_gestures;
pub mod words;
