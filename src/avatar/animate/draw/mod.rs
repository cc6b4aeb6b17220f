//! Poses drawn as pictures: a skeleton from a view, and keypoints over a video frame.

pub mod figure;
pub mod overlay;
