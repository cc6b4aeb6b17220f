//! Evaluation of generated gestures: `clips` (from pairs of files, or from a dataset and checkpoints), `baseline`
//! (predictors to compare with), `table` (metrics in blocks, bootstrap intervals, results, comparison) and `verdict`
//! (conclusions as text).

pub mod baseline;
pub mod clips;
pub mod evaluation;
pub mod table;
pub mod verdict;

pub use evaluation::Evaluation;
