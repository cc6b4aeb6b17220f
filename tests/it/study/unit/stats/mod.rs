//! Tests of single modules of `orator_study::stats`.

mod cluster_votes;
mod crossed;
mod sides;
