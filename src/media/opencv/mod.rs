//! The only folder that uses OpenCV: warps and letterboxes, pixels to tensors, heat-map filters, drawing, PNG files.

pub mod blur;
pub mod draw;
pub mod library;
pub mod png;
pub mod tensor;
pub mod warp;

pub use library::version;
