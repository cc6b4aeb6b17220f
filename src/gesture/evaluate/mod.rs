//! Evaluation of what is trained. `lifter`: errors of the lifters on motion with known truth seen by random cameras;
//! `people`: of the whole pipeline on rendered people.
//! For gestures: `clips` (from pairs of files, or from a dataset and a checkpoint), `baseline` (predictors to compare
//! with), `table` (metrics in blocks, bootstrap intervals, results, comparison) and `verdict` (conclusions in words).

pub mod baseline;
pub mod clips;
pub mod evaluation;
pub mod table;
pub mod verdict;

pub use evaluation::Evaluation;
