//! Drawings of poses: a skeleton from a given view, and keypoints over a video frame.

pub mod figure;
pub mod overlay;
