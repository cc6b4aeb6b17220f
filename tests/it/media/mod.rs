//! Audio and frames of a media file, their synchronisation, and shots.

pub(crate) mod affine;
pub(crate) mod audio_tracks;
pub(crate) mod draw;
pub(crate) mod extract;
pub(crate) mod image_formats;
pub(crate) mod joined;
pub(crate) mod media_audio;
pub(crate) mod media_frames;
pub(crate) mod shots;
pub(crate) mod sound;
pub(crate) mod sync;
mod unit;
