//! The chain of 2D models.

pub mod pose_chain;
