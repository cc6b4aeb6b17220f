//! The only folder that uses ffmpeg: `probe` (headers), `frames` (pictures at a chosen rate),
//! `audio` (sound on the same clock; `sound_stream` on demand), `write` (mp4, excerpts), `jpeg`. Below them: `source` opens
//! files, `decode` decodes one stream, `picture` converts to upright RGB by `orientation` and `filter`.
//! Time 0 is the first picture that decodes (`origin`); without pictures it is the first sample.

pub mod audio;
pub mod decode;
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
