//! Tests of single modules of `orator-study`.

mod analyse;
mod bradley_terry;
mod build;
mod database;
mod design;
mod elo;
mod estimate;
mod exclusion;
mod file;
mod film;
mod listen;
mod pages;
mod power;
mod preregistration;
mod proportion;
mod rank;
mod statistic;
mod stats;
mod stimuli;
mod study_server;
mod text;
