//! Kills, memory, bad and hostile input, lost output, privacy, programs side by side, the processes in which videos are
//! read.

pub mod bad_input;
pub mod earlier_versions;
pub mod faults;
pub mod hostile_files;
pub mod kill;
pub mod memory;
pub mod output;
pub mod parts;
pub mod privacy;
pub mod runner;
pub mod sandbox;
pub mod side_by_side;
