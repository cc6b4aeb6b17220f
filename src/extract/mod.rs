//! Stage 1: a video to its sound at 16 kHz mono, the frame timeline at the dataset rate, and its shots, in one pass
//! over the pictures and one over the sound. `shots` knows cuts, `stage` the files.

mod shots;
mod stage;

pub use stage::Extract;
