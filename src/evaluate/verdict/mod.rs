//! What an evaluation says in words: the verdict on a result, the labels of metrics, and the text of the terminal.

pub mod labels;
pub mod text;
pub mod verdict;
