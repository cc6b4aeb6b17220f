//! The skeleton that is animated: bones and their frames, bone names of other programs, limits of every joint.

pub mod constraints;
pub mod file_skeleton;
pub mod hinge;
pub mod limits;
pub mod names;
pub mod rig;
