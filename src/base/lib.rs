//! What every other crate builds on, without any foreign library: plain values (`types`), mathematics (`math`), the body
//! as numbers (`motion`), sound features (`audio`), reading of foreign files (`input`), how a step runs, is recorded and
//! resumes (`stage`), and how programs of others are started (`foreign_program`).

pub mod audio;
pub mod foreign_program;
pub mod input;
pub mod math;
pub mod motion;
pub mod stage;
pub mod types;
