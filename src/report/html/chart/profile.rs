//! Overlaid distributions as lines.

use super::histogram::Counts;
use super::scale::{Scale, drawing, line, stroke, text_at};
use crate::html::node::{Node, node};
use orator_base::text::number;

const WIDTH: f64 = 340.0;
const HEIGHT: f64 = 130.0;
const TOP: f64 = 10.0;
const FLOOR: f64 = 100.0;
const LEFT: f64 = 8.0;
const RIGHT: f64 = 332.0;

/// Card with overlaid distributions (CSS class, counts); `medians` is the text with their medians.
pub fn card(title: &str, unit: &str, lines: &[(&str, &Counts)], medians: String) -> Node {
    node("div")
        .class("card speed")
        .child(node("h3").text(title))
        .child(profile(&format!("{title}: {medians}"), unit, lines))
        .child(node("small").text(medians))
}

/// Drawing of the distributions; heights are proportional to the square root of the share. All must have the same bins.
fn profile(label: &str, unit: &str, lines: &[(&str, &Counts)]) -> Node {
    let mut svg = drawing(WIDTH, HEIGHT, label);
    let Some((_, first)) = lines.first() else { return svg };
    let x = Scale { low: first.low, high: first.high, from: LEFT, to: RIGHT };
    let share = |counts: &Counts, bin: usize| counts.bins[bin] as f64 / counts.total().max(1) as f64;
    let shares = |counts: &Counts| (0..counts.bins.len()).map(|bin| share(counts, bin)).fold(0.0, f64::max);
    let max = lines.iter().map(|(_, counts)| shares(counts)).fold(1e-9, f64::max);
    for (class, counts) in lines.iter().filter(|(_, counts)| counts.total() > 0) {
        let y = |bin: usize| FLOOR - (share(counts, bin) / max).sqrt() * (FLOOR - TOP);
        let middle = |bin: usize| (counts.edge(bin) + counts.edge(bin + 1)) / 2.0;
        svg = svg.child(stroke(class, (0..counts.bins.len()).map(|bin| [x.at(middle(bin)), y(bin)])));
        let median = x.at(counts.quantile(0.5));
        svg = svg.child(line(&format!("middle {class}"), [median, TOP], [median, FLOOR]));
    }
    svg = svg.child(line("axis", [LEFT, FLOOR], [RIGHT, FLOOR]));
    for tick in x.ticks(5) {
        let anchor = if tick <= first.low { "start" } else { "middle" };
        svg = svg.child(text_at("tick", [x.at(tick), FLOOR + 15.0], anchor, &number(tick)));
    }
    svg.child(text_at("tick", [RIGHT, FLOOR + 28.0], "end", unit))
}
