//! Page of an analysis: conclusions, charts, statistics with registration status, exclusions.

mod charts;
mod page;
mod tables;

pub use page::html;
