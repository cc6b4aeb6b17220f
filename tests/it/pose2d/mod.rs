//! Keypoint detection with the chain of 2D models.

pub(crate) mod appearance;
pub(crate) mod chosen_person;
pub(crate) mod decode;
pub(crate) mod footage_conditions;
pub(crate) mod pose_chain;
pub(crate) mod region;
pub(crate) mod shared_models;
pub(crate) mod tracker;
mod unit;
pub(crate) mod visibility;
