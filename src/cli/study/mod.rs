//! `orator study`.

pub mod analyse;
pub mod build;
pub mod export;
pub mod plan;
pub mod serve;
pub mod verb;

pub use verb::{Args, run};
