//! Keypoints that other programs found, in place of a video's pictures: `follow` chooses one person, `resample` brings them
//! to the dataset rate, `taken` is both, `stage` writes what `extract` and `pose2d` write of a video, so that the road
//! goes on from `segment`, and chooses between the two.

pub mod follow;
pub mod resample;
pub mod stage;
pub mod taken;

pub use taken::{TakenKeypoints, take_in};
