//! Tests of single modules of `orator_gesture::train::seq2seq`.

mod segments;
mod step;
