//! The lifters' errors on motion with known truth: any captured file, seen by random cameras. No training here.

pub mod bodies;
pub mod hands;
