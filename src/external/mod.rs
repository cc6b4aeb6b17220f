//! One door each for the three foreign libraries and the program that aligns words, and the restriction of a process that lets them read foreign files.

pub mod aligner;
pub mod ffmpeg;
pub mod onnx;
pub mod opencv;
pub mod sandbox;
