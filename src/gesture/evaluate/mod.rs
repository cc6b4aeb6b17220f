//! Evaluation of generated gestures: `clips` (from files, or a dataset and checkpoints), `baseline` (predictors),
//! `table` (metrics in blocks, bootstrap intervals, results, comparison) and `conclusion` (conclusions as text).

pub mod baseline;
pub mod clips;
pub mod conclusion;
pub mod evaluation;
pub mod table;

pub use evaluation::Evaluation;
