//! BVH files: read, written, and what their joints are called.

pub mod exponential_maps;
pub mod joint_names;
pub mod read;
pub mod skeleton;
pub mod write;
