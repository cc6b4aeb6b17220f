//! Moving previews of lifted motion on a page.

pub mod motion;

pub use motion::MotionPreview;
