//! `orator-lab evaluate`.

pub mod lifter;
pub mod people;
pub mod verb;

pub use verb::{Args, run};
