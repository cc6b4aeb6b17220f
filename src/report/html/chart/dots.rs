//! Line drawing with dots that are coloured by a share.

use super::scale::{circle, drawing, line, text_at};
use crate::html::node::{Node, node};

#[derive(Clone, Debug)]
pub struct ChartDot {
    pub at: [f64; 2],
    /// Share 0..1; NaN: unknown.
    pub share: f64,
    pub radius: f64,
    /// Tooltip and text for screen readers.
    pub description: String,
}

/// Drawing of `size` (width, height) units with edges, dots and labels at positions.
pub fn dots(
    label: &str,
    size: [f64; 2],
    edges: &[[[f64; 2]; 2]],
    dots: &[ChartDot],
    labels: &[([f64; 2], String)],
) -> Node {
    let mut svg = drawing(size[0], size[1], label).class("dots");
    for [from, to] in edges {
        svg = svg.child(line("edge", *from, *to));
    }
    for dot in dots {
        let class = if dot.share.is_nan() { "share unknown" } else { "share" };
        let style = format!("--share:{:.0}%", 100.0 * dot.share.clamp(0.0, 1.0));
        let drawn = circle(class, dot.at, dot.radius).attr("style", style);
        svg = svg.child(node("g").child(node("title").text(&dot.description)).child(drawn));
    }
    for (at, text) in labels {
        svg = svg.child(text_at("name", *at, "middle", text));
    }
    svg
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dot_has_its_share_and_description() {
        let dot = |share| ChartDot { at: [3.0, 4.0], share, radius: 2.0, description: "R<Wrist>: 40 %".to_owned() };
        let labels = [([1.0, 1.0], "hand".to_owned())];
        let drawn = dots("a", [9.0, 9.0], &[[[0.0, 0.0], [3.0, 4.0]]], &[dot(0.4), dot(f64::NAN)], &labels).to_string();
        assert!(drawn.contains("--share:40%") && drawn.contains("<title>R&lt;Wrist&gt;: 40 %</title>"), "{drawn}");
        assert!(drawn.contains("share unknown") && drawn.contains("edge"), "{drawn}");
    }
}
