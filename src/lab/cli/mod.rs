//! The command line of `orator-lab`, on the terminal, signals and exit codes of `orator`.

pub mod demo;
pub mod docs;
pub mod evaluate;
pub mod program;
pub mod train;

pub use program::main;
