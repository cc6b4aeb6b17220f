//! Kills, memory, bad and hostile input, lost output, privacy.

pub mod bad_input;
pub mod earlier_versions;
pub mod hostile_files;
pub mod kill;
pub mod memory;
pub mod output;
pub mod privacy;
pub mod runner;
