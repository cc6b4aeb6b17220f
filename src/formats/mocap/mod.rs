//! Motion that others captured, read into this program's skeleton.

pub mod bvh;
pub mod captured;
pub mod facing;
pub mod fingers;
pub mod motion_file;
pub mod smplx;
pub mod ted;
