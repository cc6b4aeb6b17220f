//! Sound and pictures of a file, in step; shots.

pub(crate) mod extract;
pub(crate) mod media_frames;
pub(crate) mod media_sound;
pub(crate) mod pictures;
pub(crate) mod shots;
pub(crate) mod sync;
pub(crate) mod tracks;
