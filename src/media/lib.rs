//! The only crate that calls FFmpeg and OpenCV. It also contains the sandbox of processes that read untrusted files,
//! file-backed memory, and the external program for forced alignment of words.

pub mod aligner;
pub mod ffmpeg;
pub mod file_memory;
pub mod opencv;
pub mod sandbox;
