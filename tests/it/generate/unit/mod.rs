//! Tests of single modules.

mod trained;
