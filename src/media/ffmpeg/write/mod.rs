//! Writers of media files: `encode` creates an mp4 from images, `excerpt` copies a part of a video without re-encoding.

pub mod encode;
pub mod excerpt;
