//! Readers for motion captured by others, converted to the skeleton of this program.

pub mod bvh;
pub mod captured;
pub mod facing;
pub mod fingers;
pub mod motion_file;
pub mod smplx;
pub mod ted;
