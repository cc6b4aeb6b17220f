//! The chain of 2D models.

pub(crate) mod pose_chain;
pub(crate) mod real_life;
