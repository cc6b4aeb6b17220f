//! The only folder that uses ffmpeg: `probe` (headers), `frames` (images at a chosen rate), `audio` (audio on the
//! same clock; `sound_stream` as an iterator), `write` (mp4), `jpeg`. They are built on `source`, which
//! opens files, `decode`, which decodes one stream with the times of `clock`, `picture`, which converts to upright RGB
//! using `orientation` and `filter`, and `downmix` (mono). Time 0 is the first image that decodes (`origin`), or else
//! the first audio sample.

pub mod audio;
pub mod clock;
pub mod decode;
pub mod downmix;
pub mod filter;
pub mod frames;
pub mod jpeg;
pub mod orientation;
pub mod origin;
pub mod picture;
pub mod probe;
pub mod resample;
pub mod sound_stream;
pub mod source;
pub mod write;

pub use source::{UnreadableMedia, version};
