//! Tests of single modules of `orator-report`.

mod node;
