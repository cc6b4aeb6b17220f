//! Tests of single modules.

mod resample;
