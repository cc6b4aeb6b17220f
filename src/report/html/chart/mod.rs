//! SVG charts that need no script.

pub mod dots;
pub mod forest;
pub mod histogram;
pub mod lines;
pub mod scale;
pub mod timeline;
