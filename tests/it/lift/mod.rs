//! Lifting of 2D keypoints to 3D joints.

pub(crate) mod hand_depth;
pub(crate) mod lift;
pub(crate) mod lift_bad_input;
pub(crate) mod lift_camera;
pub(crate) mod lift_joints;
pub(crate) mod lift_outliers;
pub(crate) mod lift_units;
mod unit;
pub(crate) mod weights;
