//! Keypoints of other programs: their formats, what is wrong with them, their road to a dataset.

pub mod bad_input;
pub mod formats;
pub mod road;
