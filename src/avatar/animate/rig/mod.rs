//! The animated skeleton: bones and their axes, bone names of other programs, and joint limits.

pub mod constraints;
pub mod file_skeleton;
pub mod hinge;
pub mod limits;
pub mod names;
pub mod rig;
