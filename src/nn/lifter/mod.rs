//! Networks for lifting from 2D to 3D: the temporal-convolution network and the body lifter based on it, and the hand
//! lifters on coordinates and on score maps.

pub mod body;
pub mod hand;
pub mod heatmap_network;
pub mod score_maps;
pub mod temporal;
