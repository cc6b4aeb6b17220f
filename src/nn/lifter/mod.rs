//! The networks that lift 2D to 3D: the temporal convolutions with the body lifter on them, and the hand lifter.

pub mod body;
pub mod hand;
pub mod temporal;
