//! `orator-lab demo`.

pub mod learned;
pub mod verb;

pub use verb::{Args, run};
