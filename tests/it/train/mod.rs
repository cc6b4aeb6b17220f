//! Operators, networks, training.

pub(crate) mod best_checkpoint;
pub(crate) mod channels;
pub(crate) mod from_another;
pub(crate) mod gan;
pub(crate) mod gan_program;
pub(crate) mod networks;
pub(crate) mod operators;
pub(crate) mod seq2seq;
pub(crate) mod seq2seq_program;
pub(crate) mod several_speakers;
pub(crate) mod watched;
pub(crate) mod windows_from_shards;
