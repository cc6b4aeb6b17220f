//! Conclusions as text: the verdict on a result, labels of metrics, and the table for the terminal.

pub mod labels;
pub mod text;
pub mod verdict;
