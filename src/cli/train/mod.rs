//! `orator train`.

pub mod basis;
pub mod corpus;
pub mod embedding;
pub mod gan;
pub mod lifter;
pub mod noise;
pub mod pose;
pub mod seq2seq;
mod stopped;
pub mod verb;
mod watched;

pub use verb::{Args, run};
