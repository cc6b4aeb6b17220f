//! Tests of single modules of `orator-dataset`.

mod auto;
mod former;
mod info;
mod joint_stats;
mod load;
mod seq2seq;
mod transcripts;
