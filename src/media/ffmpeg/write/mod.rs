//! Writer of media files: `encode` creates an mp4 from images.

pub mod encode;
