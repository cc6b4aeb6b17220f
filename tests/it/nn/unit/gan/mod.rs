//! Tests of single modules of `orator_nn::gan`.

mod speaker_layer;
mod streaming;
mod words;
