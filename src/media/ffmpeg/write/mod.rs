//! Media files that are written: `encode` makes an mp4 of pictures, `excerpt` copies a piece of a video as it is coded.

pub mod encode;
pub mod excerpt;
