//! Stage 1: video to 16 kHz mono audio, the frame timeline at the dataset rate, and shot boundaries, in one pass over
//! the pictures (`reading`) and one over the audio. `shots` finds cuts and, with `dissolves`, gradual transitions, on
//! `thumbnail`s compared by `block_match`; `survey` detects interlacing and `bars`; `spans` splits a long video into
//! parts for several workers; `stage` writes the outputs.

pub mod bars;
pub mod block_match;
pub mod dissolves;
pub mod reading;
pub mod shots;
pub mod spans;
pub mod stage;
pub mod survey;
pub mod thumbnail;

pub use stage::{ExtractStage, picture_options};
