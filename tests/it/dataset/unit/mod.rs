//! Tests of single modules of `orator-dataset`.

mod info;
mod joint_stats;
mod load;
mod transcripts;
