//! What the numbers a model gives mean, one file a kind of output. Slices in, places in pixels of the model's input out;
//! no model, no picture, nothing remembered. Numbers that are not finite are not found, never a panic.

pub mod boxes;
pub mod heatmap;
pub mod points;
pub mod ssd_anchors;
pub mod yolox_grid;

pub use points::ScoredPoint;
