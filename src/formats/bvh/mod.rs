//! BVH files: read, written, and what their joints are called.

pub mod joint_names;
pub mod read;
pub mod write;
