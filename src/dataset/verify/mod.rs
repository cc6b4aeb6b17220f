//! Verification of a dataset: checksums, splits, samples, arrays.

pub mod blocks;
pub mod sample;
pub mod verify;
