//! Verbs of the program.

pub mod bench;
pub mod completions;
pub mod demo;
pub mod guide;
pub mod models_verb;
