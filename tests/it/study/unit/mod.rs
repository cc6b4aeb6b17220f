//! Tests of single modules of `orator-study`.

mod bradley_terry;
mod build;
mod database;
mod elo;
mod estimate;
mod exclusion;
mod film;
mod listen;
mod proportion;
mod rank;
mod statistic;
mod study_server;
mod text;
