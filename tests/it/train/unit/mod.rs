//! Tests of single modules.

mod average;
mod epochs;
mod gan;
mod seq2seq;
