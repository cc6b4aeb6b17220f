//! Tests of single modules of `orator_gesture::generate::seq2seq`.

mod metadata;
