//! Verbs for keypoints and joints: `lift`, `sheet`; `video` is a video as input of `lift` and `animate`.

pub mod lift;
pub mod sheet;
pub mod video;
