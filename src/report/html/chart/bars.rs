//! Parts of a whole as bars in a table.

use crate::html::node::{Node, node};
use crate::html::numbers::{length, percent};

/// Part of a whole.
pub struct StackedBar {
    pub name: String,
    /// CSS class of its colour.
    pub class: String,
    pub secs: f64,
    /// Meaning in a sentence; may be empty.
    pub description: &'static str,
}

/// Table with a row a part in the given order; shares are of `whole_secs`.
pub fn bars(caption: &str, parts: &[StackedBar], whole_secs: f64) -> Node {
    let longest = parts.iter().map(|part| part.secs).fold(0.0, f64::max).max(1e-9);
    let row = |part: &StackedBar| {
        let bar = node("div")
            .class(format!("bar {}", part.class))
            .attr("style", format!("width:{:.2}%", 100.0 * part.secs / longest));
        let name = node("th").attr("scope", "row").text(&part.name);
        let name = if part.description.is_empty() { name } else { name.child(node("small").text(part.description)) };
        node("tr")
            .child(name)
            .child(node("td").class("barcell").child(bar))
            .child(node("td").class("num").text(length(part.secs)))
            .child(node("td").class("num").text(percent(part.secs, whole_secs)))
    };
    node("table")
        .class("bars")
        .child(node("caption").class("unseen").text(caption))
        .child(node("tbody").children(parts.iter().map(row)))
}
