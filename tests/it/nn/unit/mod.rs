//! Tests of single modules.

mod axis;
mod body;
mod channel_stats;
mod config;
mod cpu;
mod dropout;
mod frames;
mod gan;
mod generator;
mod lifter;
mod ops;
mod seq2seq;
mod tensor;
