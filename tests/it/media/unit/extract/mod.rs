//! Tests of single modules of `orator_pipeline::extract`.

mod bars;
mod block_match;
mod restart_spans;
mod shots;
mod thumbnail;
