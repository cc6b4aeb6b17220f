//! `orator evaluate`.

pub mod compare;
pub mod verb;

pub use verb::{Args, run};
