//! Tests of single modules.

mod batch;
mod generated_model;
mod representation;
mod seq2seq;
mod trained;
mod word_input;
