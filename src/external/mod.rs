//! One door each for the three foreign libraries and the program that aligns words, the restriction of a process that lets
//! them read foreign files, and memory that lies in a file.

pub mod aligner;
pub mod ffmpeg;
pub mod file_memory;
pub mod onnx;
pub mod opencv;
pub mod sandbox;
