//! Speech recognition with Whisper (Radford et al. 2022): log-mel spectrogram, network, decoding and word times.
//! Inference only, on the CPU.

mod align;
mod decode;
pub mod mel;
pub mod network;
mod recognise;
mod recognised;
mod spans;
pub mod tokenizer;

pub use recognise::{Recogniser, RecogniserOptions, SampleSource};
pub use recognised::{Recognised, RecognisedSegment, RecognisedWord};
