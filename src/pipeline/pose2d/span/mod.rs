//! A video in spans, which several workers share: `video_frames` reads the frames of one, `pass` looks at them, into
//! `keypoint_frames`; `pose_span` is what was seen, and how one span is joined to those before.

pub mod keypoint_frames;
pub mod pass;
pub mod pose_span;
pub mod video_frames;

pub use pose_span::PoseSpan;
