//! Tests of single modules of `orator_study::file`.

mod read;
