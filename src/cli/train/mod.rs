//! `orator train`.

pub mod gan;
pub mod seq2seq;
pub mod stopped;
pub mod training;
pub mod verb;

pub use verb::{Args, run};
