//! HTML page of an analysis: conclusions, charts, all statistics with their registration status, exclusions, the
//! methods paragraph.

mod charts;
mod page;
mod tables;

pub use page::html;
