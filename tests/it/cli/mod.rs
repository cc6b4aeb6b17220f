//! Verbs of the program.

pub mod bench;
pub mod demo;
pub mod models_verb;
