//! Speech to motion files: one sound, or a folder or table of sounds as units of a stage, so that what is there already is
//! not made again.

pub mod job;
pub mod motion_files;
pub mod sequence_files;
pub mod sounds;
pub mod spoken;
pub mod stage;
pub mod transcripts;

pub use job::{BatchOutcome, BatchReport, BatchState, SpeechBatch};
