//! `orator train`.

pub mod gan;
pub mod seq2seq;
pub mod stopped;
pub mod verb;
mod watched;

pub use verb::{Args, run};
