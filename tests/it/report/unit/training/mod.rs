//! Tests of single modules of `orator_report::training`.

mod charts;
mod strip;
