//! The only crate that calls FFmpeg and OpenCV. It also contains the sandbox of processes that read untrusted files, and
//! file-backed memory.

pub mod ffmpeg;
pub mod file_memory;
pub mod opencv;
pub mod sandbox;
