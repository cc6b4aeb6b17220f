//! Joints to rotations, and the files people open: BVH, MP4.

pub mod bvh;
pub mod figure;
pub mod rotations;
