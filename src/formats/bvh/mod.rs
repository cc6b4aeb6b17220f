//! BVH files: reader, writer, joint names, and conversion to exponential maps.

pub mod exponential_maps;
pub mod joint_names;
pub mod read;
pub mod skeleton;
pub mod write;
