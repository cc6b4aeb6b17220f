//! Tests of single modules of `orator_study::analyse`.

mod pair;
mod share;
mod task;
mod votes_read;
