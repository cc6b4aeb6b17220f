//! The only folder that uses OpenCV: warps and letterboxes, conversion to tensors, heat-map filters, drawing. PNG
//! files are also here.

pub mod blur;
pub mod draw;
pub mod png;
pub mod tensor;
pub mod warp;

pub use warp::version;
