//! Keypoints of other programs, used instead of a video's pictures: `follow` selects one person, `resample`
//! interpolates to the dataset rate, `convert` combines both, and `stage` writes the outputs of `extract` and `pose2d`
//! in their place, so that `segment` can continue, and dispatches each unit by its source.

pub mod convert;
pub mod follow;
pub mod resample;
pub mod stage;

pub use convert::{ConvertedKeypoints, convert};
