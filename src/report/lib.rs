//! HTML reports: pages on a speaker's `videos`, on a `training` and on an `evaluation`, written with `html`.

pub mod evaluation;
pub mod html;
pub mod preview;
pub mod training;
pub mod videos;

pub use videos::page::{ReportPage, ReportRequest, make};
pub use videos::summary::ReportTotals;
