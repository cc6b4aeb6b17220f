//! Stage 1: a video to its sound at 16 kHz mono, the frame timeline at the dataset rate, and where shots begin, in one
//! pass over the pictures (`reading`) and one over the sound. `shots` finds cuts and, with `dissolves`, gradual
//! transitions, all on `thumbnail`s by `block_match`; `survey` finds interlaced pictures and `bars`; `spans` cuts
//! a long video into what several workers share; `stage` writes the files.

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
