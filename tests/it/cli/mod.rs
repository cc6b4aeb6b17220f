//! Verbs of the program.

pub mod demo;
pub mod models_verb;
