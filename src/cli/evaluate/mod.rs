//! `orator evaluate`.

pub mod speakers;
pub mod verb;

pub use verb::{Args, run};
