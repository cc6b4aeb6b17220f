//! The only room that knows ffmpeg: probing, sound, frames as a stream by presentation time, encoding.
