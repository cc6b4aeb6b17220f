//! Pages for people.

pub mod evaluate_page;
pub mod report;
pub mod sheet;
pub mod sliders;
