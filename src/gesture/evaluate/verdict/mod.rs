//! Conclusions in words: the verdict on a result, labels of metrics, and the text for the terminal.

pub mod labels;
pub mod text;
pub mod verdict;
