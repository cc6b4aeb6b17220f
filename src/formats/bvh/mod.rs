//! BVH files: reader, frame rate, writer, and conversion to exponential maps.

pub mod exponential_maps;
pub mod frame_time;
mod motion_lines;
pub mod read;
pub mod skeleton;
mod words;
pub mod write;
