//! 2D to 3D.

pub mod lift;
pub mod lift_bad_input;
pub mod lift_camera;
pub mod lift_joints;
pub mod lift_outliers;
pub mod lift_units;
