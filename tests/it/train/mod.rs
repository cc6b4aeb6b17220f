//! Operators, networks, training.

pub(crate) mod best_checkpoint;
pub(crate) mod channels;
pub(crate) mod fine_tuning;
pub(crate) mod gan;
pub(crate) mod gan_program;
mod gan_words;
pub(crate) mod interrupted;
pub(crate) mod losses;
pub(crate) mod networks;
pub(crate) mod operators;
mod optim;
pub(crate) mod reading;
pub(crate) mod run_train;
pub(crate) mod seq2seq;
pub(crate) mod seq2seq_program;
pub(crate) mod several_speakers;
mod unit;
pub(crate) mod windows_from_shards;
