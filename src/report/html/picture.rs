//! Pictures embedded in the page.

use super::node::{Node, node};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

/// JPEG of `width` x `height` px, loaded when it comes into view, with `description` as its alternative text.
pub fn jpeg(bytes: &[u8], [width, height]: [usize; 2], description: &str) -> Node {
    node("img")
        .attr("src", format!("data:image/jpeg;base64,{}", STANDARD.encode(bytes)))
        .attr("width", width)
        .attr("height", height)
        .attr("alt", description)
        .attr("loading", "lazy")
}
