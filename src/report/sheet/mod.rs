//! Contact sheets of lifted clips: video frames with keypoints, and joints from the front and the side.

pub mod cells;
pub mod sheet;
