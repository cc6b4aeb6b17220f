//! The networks that lift 2D to 3D: the temporal convolutions, the body lifter and the hand lifter on them, and the
//! lifter of hand heat-maps.

pub mod body;
pub mod hand;
pub mod heatmap;
pub mod temporal;
