//! Generation of motion files from speech: for a single sound, or for a folder or table of sounds as units of a stage,
//! so that up-to-date files are not generated again.

pub mod motion_files;
pub mod sounds;
pub mod speech;
pub mod stage;
pub mod transcripts;

pub use stage::{BatchOutcome, BatchReport, BatchState, SpeechBatch};
