//! Joints to rotations, and the files people open: BVH, MP4.

pub mod bvh;
pub mod draw;
pub mod figure;
pub mod file;
pub mod rotations;
pub mod video;

pub use draw::{View, draw_pose};
