//! Histogram with a threshold, bins on the failing side in another colour; and overlaid distributions as lines.

use super::scale::{Scale, drawing, line, px, rect, stroke, text_at};
use crate::html::node::{Node, node};
use orator_base::text::{number, with_unit};

/// Counts in bins of equal width from `low` to `high`; the outer bins include values outside the range.
#[derive(Clone, Debug)]
pub struct Counts {
    pub low: f64,
    pub high: f64,
    pub bins: Vec<u64>,
    /// Number of NaN values.
    pub unknown: u64,
}

impl Counts {
    pub fn new(low: f64, high: f64, n_bins: usize) -> Self {
        Self { low, high, bins: vec![0; n_bins.max(1)], unknown: 0 }
    }

    /// Counts a value; NaN counts as unknown.
    pub fn add(&mut self, value: f64) {
        if value.is_nan() {
            self.unknown += 1;
            return;
        }
        let share = (value - self.low) / (self.high - self.low);
        let bin = ((share * self.bins.len() as f64 + 1e-6).max(0.0) as usize).min(self.bins.len() - 1);
        self.bins[bin] += 1;
    }

    /// Number of known values.
    pub fn total(&self) -> u64 {
        self.bins.iter().sum()
    }

    pub fn edge(&self, bin: usize) -> f64 {
        self.low + (self.high - self.low) * bin as f64 / self.bins.len() as f64
    }

    /// Quantile `share` (0..1), interpolated linearly within its bin; NaN without values.
    pub fn quantile(&self, share: f64) -> f64 {
        let target = share * self.total() as f64;
        let mut before = 0.0;
        for (bin, count) in self.bins.iter().enumerate().filter(|(_, count)| **count > 0) {
            let count = *count as f64;
            if before + count >= target {
                let inside = ((target - before) / count).clamp(0.0, 1.0);
                return self.edge(bin) + inside * (self.edge(bin + 1) - self.edge(bin));
            }
            before += count;
        }
        f64::NAN
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThresholdLine {
    pub value: f64,
    /// Whether values below the threshold fail; otherwise values above it fail.
    pub is_minimum: bool,
}

const WIDTH: f64 = 340.0;
const HEIGHT: f64 = 150.0;
const TOP: f64 = 22.0;
const FLOOR: f64 = 122.0;
const LEFT: f64 = 8.0;
const RIGHT: f64 = 332.0;

/// Histogram as SVG. Heights follow the square root of the share, so that rare values remain visible.
pub fn histogram(label: &str, counts: &Counts, unit: &str, threshold: Option<ThresholdLine>) -> Node {
    let x = Scale { low: counts.low, high: counts.high, from: LEFT, to: RIGHT };
    let max_count = counts.bins.iter().copied().max().unwrap_or(0).max(1) as f64;
    let mut svg = drawing(WIDTH, HEIGHT, label);
    for (bin, &count) in counts.bins.iter().enumerate().filter(|(_, count)| **count > 0) {
        let (from, to) = (counts.edge(bin), counts.edge(bin + 1));
        let middle = (from + to) / 2.0;
        let fails = threshold.is_some_and(|t| if t.is_minimum { middle < t.value } else { middle > t.value });
        let height = ((count as f64 / max_count).sqrt() * (FLOOR - TOP)).max(1.0);
        let class = if fails { "bin fails" } else { "bin" };
        let (left, right) = (x.at(from), x.at(to));
        svg = svg.child(rect(class, [left + 0.4, FLOOR - height], [(right - left - 0.8).max(0.5), height]));
    }
    svg = svg.child(line("axis", [LEFT, FLOOR], [RIGHT, FLOOR]));
    for tick in x.ticks(6) {
        let at = x.at(tick);
        let anchor = match at {
            at if at < LEFT + 10.0 => "start",
            at if at > RIGHT - 10.0 => "end",
            _ => "middle",
        };
        svg = svg.child(line("axis", [at, FLOOR], [at, FLOOR + 4.0]));
        svg = svg.child(text_at("tick", [at, FLOOR + 17.0], anchor, &number(tick)));
    }
    if let Some(ThresholdLine { value, is_minimum }) = threshold {
        let at = x.at(value);
        let anchor = if at > (LEFT + RIGHT) / 2.0 { "end" } else { "start" };
        let description = format!("at {} {}", if is_minimum { "least" } else { "most" }, with_unit(value, unit));
        svg = svg.child(line("threshold", [at, TOP - 8.0], [at, FLOOR]).attr("data-x", px(at)));
        svg = svg.child(text_at(
            "mark",
            [if anchor == "end" { at - 4.0 } else { at + 4.0 }, TOP - 9.0],
            anchor,
            &description,
        ));
    }
    svg
}

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
    const HEIGHT: f64 = 130.0;
    const TOP: f64 = 10.0;
    const FLOOR: f64 = 100.0;
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
