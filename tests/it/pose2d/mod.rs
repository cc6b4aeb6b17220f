//! Keypoint detection with the chain of 2D models.

pub(crate) mod footage_conditions;
pub(crate) mod pose_chain;
