//! Pages and pictures for people: `videos` (a speaker's videos), `training`, `evaluation`, rendered `people`,
//! and contact sheets (`sheet`), all written with `html`.

pub mod evaluation;
pub mod faces;
pub mod html;
pub mod preview;
pub mod sheet;
pub mod training;
pub mod videos;

pub use videos::page::{ReportPage, ReportRequest, make};
pub use videos::summary::ReportTotals;
