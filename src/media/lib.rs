//! The only crate that calls FFmpeg and OpenCV. Also here: the sandbox of processes that read foreign files, file-backed
//! memory, and the external program that aligns words with sound.

pub mod aligner;
pub mod ffmpeg;
pub mod file_memory;
pub mod opencv;
pub mod sandbox;
