//! `orator-lab train`.

pub mod basis;
pub mod corpus;
pub mod embedding;
pub mod lifter;
pub mod noise;
pub mod verb;

pub use verb::{Args, run};
