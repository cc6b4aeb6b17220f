//! One door each for the three foreign libraries.

pub mod ffmpeg;
pub mod onnx;
pub mod opencv;
