//! `orator animate`.

pub mod input;
pub mod verb;

pub use verb::{Args, run};
