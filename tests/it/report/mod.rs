//! HTML pages and contact sheets.

pub(crate) mod evaluate_page;
pub(crate) mod forest;
pub(crate) mod report;
pub(crate) mod sheet;
pub(crate) mod sliders;
pub(crate) mod videos;
