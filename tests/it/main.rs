//! The integration tests: one binary, a module a concern.

mod animate;
mod cli;
mod dataset;
mod evaluate;
mod fixtures;
mod foreign;
mod generate;
mod house;
mod lift;
mod media;
mod parity;
mod pose2d;
mod report;
mod robustness;
mod segment;
mod train;
mod wording;
