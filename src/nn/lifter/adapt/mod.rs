//! Adaptation of the body lifter to one speaker, after the semi-supervised training of Pavllo et al. 2019: `samples`
//! (windows of the speaker's own keypoints, and labelled windows of the same skeleton under other cameras) -> `losses`
//! (reprojection, constant bone lengths, labelled positions) -> `fine_tune`. `skeleton` measures the held-out error.

pub mod fine_tune;
pub mod losses;
pub mod samples;
pub mod skeleton;
