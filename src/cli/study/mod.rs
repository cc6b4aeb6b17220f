//! `orator study`.

pub mod analyse;
pub mod build;
pub mod plan;
pub mod verb;

pub use verb::{Args, run};
