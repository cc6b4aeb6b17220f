//! Tests of single modules.

mod jpeg;
mod png;
