//! Synthetic bodies and hands before random cameras: the training data of the lifters.

pub mod body;
pub mod body_motion;
pub mod hand;
pub mod hand_direction;
pub mod hand_motion;
pub mod hand_noise;
pub mod hand_shape;
pub mod jumps;
pub mod noise;
pub mod reach;
