//! Keypoints of other programs: their formats, error messages, and the dataset made from them.

pub(crate) mod bad_input;
pub(crate) mod dataset_from_keypoints;
pub(crate) mod follow;
pub(crate) mod formats;
pub(crate) mod point_orders;
mod unit;
