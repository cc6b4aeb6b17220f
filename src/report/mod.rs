//! Pages and pictures for people: `videos` (a speaker's videos), `training`, `evaluation`, and contact sheets
//! (`sheet`), all written with `html`.

pub mod evaluation;
pub mod html;
pub mod sheet;
pub mod training;
pub mod videos;

pub use videos::page::ReportPage;
pub use videos::page::ReportRequest;
pub use videos::page::make;
pub use videos::summary::ReportTotals;
