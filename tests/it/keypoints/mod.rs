//! Keypoints of other programs: their formats, what is wrong with them, their road to a dataset.

pub(crate) mod bad_input;
pub(crate) mod formats;
pub(crate) mod road;
