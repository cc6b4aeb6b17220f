//! Tests of single modules of `orator_report::videos`.

mod movement;
mod timelines;
