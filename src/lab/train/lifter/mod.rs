//! Training of the lifters: body, hands, and the hand heat-map baseline with its network.

pub mod body;
pub mod conv3x3;
pub mod errors;
pub mod hands;
pub mod heatmap_network;
pub mod heatmaps;
pub mod score_maps;
