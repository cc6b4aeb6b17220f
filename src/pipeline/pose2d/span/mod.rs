//! Spans of a video, which several workers share: `video_frames` reads the frames of a span, `pass` processes them
//! into `keypoint_frames`; `pose_span` stores the result and joins the spans.

pub mod keypoint_frames;
pub mod pass;
pub mod pose_span;
pub mod video_frames;

pub use pose_span::PoseSpan;
