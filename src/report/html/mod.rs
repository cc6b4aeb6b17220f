//! HTML pages for people, the only folder that writes markup. `node` builds elements and escapes text, `document` makes
//! a self-contained file and embeds JPEG, `numbers` formats numbers, `chart` draws SVG charts. Contents are decided by
//! the pages (`videos`, `training`, `evaluation`).

pub mod chart;
pub mod document;
pub mod node;
pub mod numbers;

pub use document::{Page, Section, jpeg};
pub use node::{Node, legend, node, table};
