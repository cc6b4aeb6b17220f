//! Forced alignment by the Python package `pocketsphinx`, in a process of its own. `align.py` is what that process runs.

pub mod program;

pub use program::{AlignedWord, Aligner, SpokenWord};
