//! Videos of one speaker to a 3D speech-gesture dataset, and to a model that gestures like that speaker.
//!
//! The way of a frame, never turning back:
//! `media::frames` -> `vision` (crop, warp) -> `onnx` -> `pose2d` (decode, track) -> *keypoints file* -> `segment` ->
//! `lift` -> *joints file* -> `dataset` -> *shard* -> `dataset::loader` -> `train::gan`.
//! The way of a sample of sound: `media::audio` -> *audio file* -> `dataset` -> *shard* -> loader -> `audio::mel` ->
//! `nn` generator. The two meet by time in seconds, in one place.

pub mod animate;
pub mod audio;
pub mod config;
pub mod dataset;
pub mod extract;
pub mod generate;
pub mod lift;
pub mod media;
pub mod motion;
pub mod nn;
pub mod onnx;
pub mod pose2d;
pub mod segment;
pub mod stage;
pub mod train;
pub mod types;
pub mod vision;
