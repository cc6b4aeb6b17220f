//! `orator generate`.

pub mod batch;
pub mod verb;

pub use verb::{Args, run};
