//! HTML reports and pictures: pages on a speaker's `videos`, on a `training` and on an `evaluation`, written with
//! `html`, and contact sheets (`sheet`).

pub mod evaluation;
pub mod html;
pub mod preview;
pub mod sheet;
pub mod training;
pub mod videos;

pub use videos::page::{ReportPage, ReportRequest, make};
pub use videos::summary::ReportTotals;
