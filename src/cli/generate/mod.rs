//! `orator generate`.

pub mod batch;
mod export;
pub mod verb;

pub use verb::{Args, run};
