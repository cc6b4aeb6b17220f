//! SVG charts that need no script.

pub mod curve;
pub mod dots;
pub mod forest;
pub mod histogram;
pub mod lines;
pub mod profile;
pub mod ranges;
pub mod scale;
pub mod timeline;
pub mod tracks;
