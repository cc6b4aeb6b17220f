//! Verbs of the program.

pub mod bench;
pub mod completions;
pub mod container;
pub mod error_texts;
pub mod examples;
pub mod guide;
pub mod library;
pub mod models_verb;
