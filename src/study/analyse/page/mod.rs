//! Page of an analysis: conclusions, charts, every figure with its mark, exclusions, the methods paragraph.

mod charts;
mod page;
mod tables;

pub use page::html;
