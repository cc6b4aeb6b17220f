//! `orator evaluate`.

pub mod compare;
pub mod lifter;
pub mod people;
pub mod verb;

pub use verb::{Args, run};
