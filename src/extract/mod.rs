//! Stage 1: a video to its sound at 16 kHz mono, the frame timeline at the dataset rate, and where shots begin, in one
//! pass over the pictures and one over the sound. `shots` knows cuts, `still` movement, `stage` the files.

mod shots;
mod stage;
mod still;

pub use stage::Extract;
