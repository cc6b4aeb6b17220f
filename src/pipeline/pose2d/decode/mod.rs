//! Decoding of model outputs, one file per kind of output. Pure functions from slices to positions in px of the model
//! input. Non-finite values count as not detected and never panic.

pub mod boxes;
pub mod heatmap;
pub mod points;
pub mod ssd_anchors;
pub mod yolox_grid;

pub use points::ScoredPoint;
