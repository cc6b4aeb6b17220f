//! HTML pages for people: the one room that writes markup. `html` builds elements and escapes every word in them,
//! `document` makes of them one file that needs nothing else, `figures` writes numbers as people read them; the rest are
//! pictures of numbers, drawn without a script: `timeline`, `bars`, `histogram`, `curve`, `chart`, `ranges`,
//! `profile`, `lanes`, `dots`, `picture`. What stands on a page is decided elsewhere (`report`).

pub mod chart;
pub mod document;
pub mod node;
pub mod numbers;
pub mod picture;

pub use document::Page;
pub use document::Section;
pub use node::Node;
pub use node::node;
