//! Stage 1: a video to its sound at 16 kHz mono, the frame timeline at the dataset rate, and where shots begin, in one
//! pass over the pictures and one over the sound. `shots` finds cuts and, with `gradual`, dissolves, wipes and fades, all
//! on `thumbnail`s by their `likeness`; `still` measures movement, `stage` knows the files.

mod gradual;
mod likeness;
mod shots;
mod stage;
mod still;
mod thumbnail;

pub use stage::Extract;
