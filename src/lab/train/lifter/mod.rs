//! Training of the lifters: body, hands, hand heat-maps.

pub mod body;
pub mod errors;
pub mod hands;
pub mod heatmaps;
