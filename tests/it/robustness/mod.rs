//! Kills, memory, bad input.

pub mod bad_input;
pub mod earlier_versions;
pub mod kill;
pub mod memory;
pub mod runner;
