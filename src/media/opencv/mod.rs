//! The only folder that uses OpenCV: warps and letterboxes, pixels to tensors, heat-map filters, drawing, PNG files.

pub mod blur;
pub mod draw;
pub mod png;
pub mod tensor;
pub mod warp;

pub use warp::version;
