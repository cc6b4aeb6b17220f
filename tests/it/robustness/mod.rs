//! Kills, memory, bad input, lost output, privacy.

pub mod bad_input;
pub mod earlier_versions;
pub mod kill;
pub mod memory;
pub mod output;
pub mod privacy;
pub mod runner;
