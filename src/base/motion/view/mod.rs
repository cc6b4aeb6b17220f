//! Inputs of the lifters: keypoints of body and hands, normalised, and hand heat-maps.

pub mod body;
pub mod hand;
pub mod heatmaps;
