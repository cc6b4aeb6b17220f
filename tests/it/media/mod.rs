//! Sound and pictures of a file, in step; shots.

pub mod extract;
pub mod media_frames;
pub mod media_sound;
pub mod pictures;
pub mod shots;
pub mod sync;
pub mod tracks;
