//! Stage 5, for speakers with `transcripts = "auto"`: audio to words with times, by the recogniser of `orator-speech`.

pub mod stage;

pub use stage::{TranscribeStage, spoken, steps_of};
