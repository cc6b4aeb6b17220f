//! Generation of HTML; no other module writes markup. `node` builds elements and escapes text, `document` creates a
//! self-contained page and embeds JPEG images, `chart` draws SVG charts. The modules
//! `videos`, `training` and `evaluation` decide what the pages contain.

pub mod chart;
pub mod document;
pub mod node;

pub use document::{Page, Section, html_file, jpeg, page_head, video};
pub use node::{Node, legend, node, table};
