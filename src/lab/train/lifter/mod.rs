//! Training of the lifters: body, and hands with either network.

pub mod body;
pub mod errors;
pub mod hands;
pub mod heatmaps;
