//! Subcommands, guide, examples, library use and error texts of the program.

pub(crate) mod bench;
pub(crate) mod completions;
mod error_list;
pub(crate) mod error_texts;
pub(crate) mod examples;
pub(crate) mod guide;
pub(crate) mod library;
pub(crate) mod models_verb;
pub(crate) mod site;
pub(crate) mod tutorial;
