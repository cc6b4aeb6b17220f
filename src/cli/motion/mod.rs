//! The verb `lift` for keypoints and videos; `video` is a video as input of `lift` and `animate`.

pub mod lift;
pub mod video;
