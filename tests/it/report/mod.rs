//! HTML pages.

pub(crate) mod evaluate_page;
pub(crate) mod forest;
pub(crate) mod report;
pub(crate) mod sliders;
mod unit;
pub(crate) mod videos;
