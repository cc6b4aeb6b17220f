//! Networks for lifting from 2D to 3D: the temporal-convolution network and the body lifter based on it, and the hand
//! lifter. `adapt` fits the body lifter to one speaker.

pub mod adapt;
pub mod body;
pub mod hand;
pub mod temporal;
