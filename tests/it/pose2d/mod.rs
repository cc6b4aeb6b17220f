//! The chain of 2D models.

pub mod pose_chain;
pub mod real_life;
