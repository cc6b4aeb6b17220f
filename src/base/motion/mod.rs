//! Motion as numbers: forward kinematics, rotations, Procrustes, smoothing, bone lengths; readers and writers of motion files. Pure but for those files.

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
