//! Check of a dataset: checksums, samples, arrays.

pub mod sample;
pub mod verify;
