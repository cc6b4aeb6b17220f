//! Tests of single modules of `orator-dataset`.

mod auto;
mod bones;
mod config;
mod former;
mod import;
mod info;
mod joint_stats;
mod load;
mod seq2seq;
mod shared_sound;
mod transcripts;
