//! Forced alignment with the Python package `pocketsphinx` in a subprocess, which runs `align.py`.

pub mod program;

pub use program::{AlignedWord, Aligner, SpokenWord};
