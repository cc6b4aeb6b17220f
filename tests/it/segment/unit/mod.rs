//! Tests of single modules of `orator-pipeline`.

mod gaps;
mod reject;
mod survey;
