//! Inputs of the lifters: normalised keypoints of body and hands.

pub mod body;
pub mod hand;
