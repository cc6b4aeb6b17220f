//! The command line, the only module that uses clap, indicatif and println. Each verb is one file, and its doc comment
//! is its `--help`. Exit codes: 0 all done; 1 usage, configuration, or a check that failed; 2 some units failed, the
//! others are done; 130 and 143 stopped by Ctrl-C or SIGTERM.

pub mod animate;
mod cluster;
pub mod config_args;
pub mod dataset;
pub mod evaluate;
mod figure_args;
pub mod generate;
pub mod live;
pub mod motion;
pub mod outputs;
pub mod pipeline;
pub mod program;
pub mod sandbox;
pub mod setup;
pub mod signals;
pub mod study;
pub mod train;
pub mod ui;
mod verb_groups;
pub mod view;

pub use program::{Outcome, main, run_program};
