//! Verbs for keypoints and joints: `lift`, `sheet`.

pub mod lift;
pub mod sheet;
