//! Tests of single modules.

mod average;
