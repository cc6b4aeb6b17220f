//! Tests of single modules.

mod aligner_program;
mod extract;
mod ffmpeg;
mod file_memory;
mod jpeg;
mod png;
