//! Generation of HTML; no other module writes markup. `node` builds elements, escapes text and creates self-contained
//! pages, `chart` draws SVG charts. The modules `videos`, `training` and `evaluation` decide what the pages contain.

pub mod chart;
pub mod node;

pub use node::{Node, Page, Section, html_file, jpeg, legend, node, page_head, table, video};
