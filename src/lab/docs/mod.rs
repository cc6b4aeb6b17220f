//! The guide as static HTML in the style of the reports: `markdown` converts a page, `site` writes all pages, `gallery`
//! runs the commands whose pictures are shown.

pub mod gallery;
pub mod markdown;
pub mod site;
