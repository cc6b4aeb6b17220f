//! Tests of single modules of `orator-pipeline`.

mod speech_activity;
