//! HTML pages for people: the one room that writes markup. `html` builds elements and escapes every word in them,
//! `document` makes of them one file that needs nothing else, `figures` writes numbers as people read them; the rest are
//! pictures of numbers, drawn without a script: `timeline`, `bars`, `histogram`, `curve`, `chart`, `ranges`,
//! `profile`, `lanes`, `dots`, `picture`. What stands on a page is decided elsewhere (`report`).

pub mod bars;
pub mod chart;
pub mod curve;
pub mod document;
pub mod dots;
pub mod figures;
pub mod histogram;
pub mod html;
pub mod lanes;
pub mod picture;
pub mod profile;
pub mod ranges;
mod scale;
pub mod timeline;

pub use document::{Page, Section};
pub use html::{Node, node};
