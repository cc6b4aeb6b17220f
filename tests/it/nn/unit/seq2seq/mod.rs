//! Tests of single modules of `orator_nn::seq2seq`.

mod encoders;
