//! Tests of single modules.

mod axis;
mod body;
mod channel_stats;
mod config;
mod dropout;
mod frames;
mod generator;
mod tensor;
