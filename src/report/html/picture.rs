//! Pictures inside the page itself.

use super::node::{Node, node};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

/// A JPEG of `width` x `height` px, loaded when it comes into view; `says` stands in for it.
pub fn jpeg(bytes: &[u8], [width, height]: [usize; 2], description: &str) -> Node {
    node("img")
        .attr("src", format!("data:image/jpeg;base64,{}", STANDARD.encode(bytes)))
        .attr("width", width)
        .attr("height", height)
        .attr("alt", description)
        .attr("loading", "lazy")
}
