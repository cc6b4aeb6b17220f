//! What every other crate builds on, without any foreign library: plain values (`types`), mathematics (`math`), the body
//! as numbers (`motion`), sound features (`audio`), reading of foreign files (`input`), and how a step runs, is recorded and resumes (`stage`).

pub mod audio;
pub mod input;
pub mod math;
pub mod motion;
pub mod stage;
pub mod types;
