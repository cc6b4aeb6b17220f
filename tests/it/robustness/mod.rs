//! Kills, memory, invalid and hostile input, unwritable output, privacy, concurrent processes, foreign programs, and
//! the sandboxed processes that read videos.

pub(crate) mod bad_input;
pub(crate) mod concurrency;
pub(crate) mod earlier_versions;
pub(crate) mod faults;
pub(crate) mod foreign_programs;
pub(crate) mod full_disk;
pub(crate) mod hostile_files;
pub(crate) mod kill;
pub(crate) mod killed_fetch;
pub(crate) mod memory;
pub(crate) mod output;
pub(crate) mod parts;
pub(crate) mod privacy;
pub(crate) mod process;
pub(crate) mod runner;
pub(crate) mod sandbox;
pub(crate) mod unit;
