//! The integration tests: one binary, a module a concern.

// The benchmark, tested by `cli::bench`, shares a fixture with the tests.
#![allow(clippy::duplicate_mod)]

mod animate;
mod base;
/// The benchmark's own modules, so that its parts are tested without a release build.
#[path = "../bench/mod.rs"]
#[allow(dead_code)] // what only the benchmark calls
mod bench;
mod cli;
mod cluster;
mod convert;
mod dataset;
mod evaluate;
mod fixtures;
mod foreign;
mod formats;
mod fuzz;
mod generate;
mod keypoints;
mod lift;
mod live;
mod media;
mod nn;
mod parity;
mod pose2d;
mod report;
mod robustness;
mod segment;
mod source_tree;
mod speech;
mod study;
mod train;
mod view;
mod vocabulary;
mod wording;
