//! Body motion: bone lengths, forward kinematics, head and trunk angles, resampling, unit checks, lifters' inputs.

pub mod bones;
pub mod exponential_map;
pub mod face;
pub mod fk;
pub mod hand_bones;
pub mod jerk;
pub mod posture;
pub mod resample;
pub mod units;
pub mod upper_body;
pub mod view;
