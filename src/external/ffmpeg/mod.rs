//! The only room that knows ffmpeg. `probe` says what a file holds, `frames` streams its pictures at a chosen rate by
//! presentation time (`ahead`: beside other work), `audio` its sound on the same clock (`sound_stream`: as it is asked for), `encode` writes mp4. Beneath
//! them: `source` opens files and names what is wrong with them, `decode` turns one stream into decoded frames, `picture`
//! makes those upright RGB.
//!
//! One clock for all: time 0 is the first picture that decodes (`origin`); a file without pictures starts with its first
//! sample.

pub mod ahead;
pub mod audio;
pub mod decode;
pub mod encode;
pub mod frames;
pub mod jpeg;
pub mod library;
pub mod origin;
pub mod picture;
pub mod probe;
pub mod resample;
pub mod sound_stream;
pub mod source;

pub use library::version;
pub use source::UnreadableMedia;
