//! The lowest layer of the project, without any foreign library: plain values (`types`), mathematics (`math`), body
//! motion (`motion`), audio features (`audio`), reading of foreign files (`input`), running, recording and resuming of
//! stages (`stage`), commands for external programs (`foreign_program`), and numbers as text (`text`).

pub mod audio;
pub mod foreign_program;
pub mod input;
pub mod math;
pub mod motion;
pub mod stage;
pub mod text;
pub mod types;
