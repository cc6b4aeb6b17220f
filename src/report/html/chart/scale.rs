//! Linear scales, round tick values, and SVG elements. Line drawing with dots that are coloured by a share.

use crate::html::node::{Node, node};

/// Linear scale that maps `low` to `from` and `high` to `to` (units of the drawing).
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    pub low: f64,
    pub high: f64,
    pub from: f64,
    pub to: f64,
}

impl Scale {
    /// Position of `value`, clamped to the ends; NaN maps to `from`.
    pub fn at(&self, value: f64) -> f64 {
        let width = self.high - self.low;
        let share = if width > 0.0 { (value - self.low) / width } else { 0.5 };
        let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
        self.from + share * (self.to - self.from)
    }

    /// About `n` round values from `low` to `high`.
    pub fn ticks(&self, n: usize) -> Vec<f64> {
        let width = self.high - self.low;
        if !(width.is_finite() && width > 0.0) || n == 0 {
            return vec![self.low];
        }
        let rough = width / n as f64;
        let power = 10_f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= rough * 0.999).unwrap_or(rough);
        let (first, last) = ((self.low / step - 1e-6).ceil() as i64, (self.high / step + 1e-6).floor() as i64);
        (first..=last).take(100).map(|k| k as f64 * step).collect()
    }
}

/// Coordinate with at most one decimal.
pub fn px(value: f64) -> String {
    let text = format!("{value:.1}");
    text.strip_suffix(".0").unwrap_or(&text).to_owned()
}

/// SVG of `width` x `height` units that scales with its column; `label` is for screen readers.
pub fn drawing(width: f64, height: f64, label: &str) -> Node {
    node("svg")
        .attr("viewBox", format!("0 0 {} {}", px(width), px(height)))
        .attr("role", "img")
        .attr("aria-label", label)
        .attr("style", format!("aspect-ratio:{} / {}", px(width), px(height)))
}

/// Attribute `d` of a path through the points.
pub fn path_data(points: impl IntoIterator<Item = [f64; 2]>) -> String {
    let points: Vec<String> = points.into_iter().map(|[x, y]| format!("{} {}", px(x), px(y))).collect();
    format!("M{}", points.join(" L"))
}

pub fn stroke(class: &str, points: impl IntoIterator<Item = [f64; 2]>) -> Node {
    node("path").class(format!("stroke {class}").trim_end()).attr("d", path_data(points))
}

pub fn circle(class: &str, [x, y]: [f64; 2], radius: f64) -> Node {
    node("circle").class(class).attr("cx", px(x)).attr("cy", px(y)).attr("r", px(radius))
}

pub fn rect(class: &str, [x, y]: [f64; 2], [width, height]: [f64; 2]) -> Node {
    let sides = [("x", x), ("y", y), ("width", width), ("height", height)];
    sides.into_iter().fold(node("rect").class(class), |rect, (name, value)| rect.attr(name, px(value)))
}

pub fn line(class: &str, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2]) -> Node {
    let ends = [("x1", x1), ("y1", y1), ("x2", x2), ("y2", y2)];
    ends.into_iter().fold(node("line").class(class), |line, (name, value)| line.attr(name, px(value)))
}

/// Text element at a point; `anchor` is `start`, `middle` or `end`.
pub fn text_at(class: &str, [x, y]: [f64; 2], anchor: &str, text: &str) -> Node {
    node("text").class(class).attr("x", px(x)).attr("y", px(y)).attr("text-anchor", anchor).text(text)
}

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
