//! Tests of single modules of `orator-pipeline`.

mod process_limits;
