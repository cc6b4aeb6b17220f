//! `orator evaluate`.

pub mod verb;

pub use verb::{Args, run};
