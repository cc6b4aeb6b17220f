//! Tests of single modules of `orator-study`.

mod bradley_terry;
mod database;
mod exclusion;
mod film;
mod listen;
mod proportion;
mod rank;
