//! `orator train`.

pub mod basis;
pub mod corpus;
pub mod embedding;
pub mod gan;
pub mod lifter;
pub mod noise;
pub mod pose;
pub mod seq2seq;
pub mod verb;

pub use verb::{Args, run};
