//! Tests of single modules of `orator-report`.

mod histogram;
mod live;
mod node;
mod scale;
