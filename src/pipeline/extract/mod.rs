//! Stage 1: a video to its sound at 16 kHz mono, the frame timeline at the dataset rate, and where shots begin, in one
//! pass over the pictures and one over the sound. `shots` finds cuts and, with `gradual`, dissolves, wipes and fades, all
//! on `thumbnail`s by their `likeness`; `still` measures movement, `stage` knows the files.

pub mod audio_file;
pub mod block_match;
pub mod dissolves;
pub mod frame_difference;
pub mod shots;
pub mod stage;
pub mod thumbnail;

pub use stage::ExtractStage;
