//! BVH files: reader, frame rate, writer, joint names, and conversion to exponential maps.

pub mod exponential_maps;
pub(crate) mod frame_time;
pub mod joint_names;
mod motion_lines;
pub mod read;
pub mod skeleton;
mod words;
pub mod write;
