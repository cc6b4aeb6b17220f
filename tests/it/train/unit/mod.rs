//! Tests of single modules.

mod average;
mod gan;
mod seq2seq;
