//! Tests of single modules of `orator_report::html`.

mod lines;
mod timeline;
