//! Operators, networks, training.

pub mod best_checkpoint;
pub mod channels;
pub mod from_another;
pub mod gan;
pub mod gan_program;
pub mod networks;
pub mod operators;
pub mod seq2seq;
pub mod seq2seq_program;
pub mod several_speakers;
pub mod watched;
pub mod windows_from_shards;
