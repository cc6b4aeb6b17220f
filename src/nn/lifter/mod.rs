//! Networks for lifting from 2D to 3D: the temporal-convolution network and the body lifter based on it, and the hand
//! lifter.

pub mod body;
pub mod hand;
pub mod temporal;
