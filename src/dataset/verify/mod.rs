//! The dataset checked: every sum, every sample, every array.

pub mod sample;
pub mod verify;
