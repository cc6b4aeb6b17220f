//! SVG charts that need no script.

pub mod forest;
pub mod histogram;
pub mod lines;
pub mod scale;
pub mod timeline;
