//! Conclusions as text: the conclusions from a result, labels of metrics, and the table for the terminal.

pub mod conclusion;
pub mod labels;
pub mod text;
