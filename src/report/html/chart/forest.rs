//! Intervals below one another on one scale: forest plot with a line at no difference and a band of equivalence, and
//! box plots (thin line from minimum to maximum, box from 5 % to 95 %, tick at the median).

use super::scale::{Scale, circle, drawing, line, rect, text_at};
use crate::html::node::{Node, node};
use orator_base::text::number;

#[derive(Clone, Debug)]
pub struct ForestRow {
    pub name: String,
    pub class: &'static str,
    pub value: f64,
    pub interval: Option<[f64; 2]>,
    /// Text to the right of the plot.
    pub value_text: String,
}

#[derive(Clone, Copy, Debug)]
pub struct ForestScale {
    pub low: f64,
    pub high: f64,
    /// Value of no difference.
    pub middle: Option<f64>,
    /// Equivalence band: values that count as no difference.
    pub band: Option<[f64; 2]>,
    pub unit: &'static str,
}

const WIDTH: f64 = 720.0;
const ROW: f64 = 26.0;
const TOP: f64 = 8.0;
const LEFT: f64 = 230.0;
const RIGHT: f64 = 560.0;

pub fn forest(label: &str, rows: &[ForestRow], scale: &ForestScale) -> Node {
    let x = Scale { low: scale.low, high: scale.high, from: LEFT, to: RIGHT };
    let floor = TOP + ROW * rows.len() as f64;
    let mut svg = drawing(WIDTH, floor + 34.0, label).class("forest");
    if let Some([low, high]) = scale.band.map(|band| band.map(|value| x.at(value))) {
        svg = svg.child(rect("band", [low, TOP], [(high - low).max(0.0), floor - TOP]));
    }
    for tick in x.ticks(5) {
        svg = svg.child(line("grid", [x.at(tick), TOP], [x.at(tick), floor]));
        svg = svg.child(text_at("tick", [x.at(tick), floor + 15.0], "middle", &number(tick)));
    }
    if let Some(middle) = scale.middle {
        svg = svg.child(line("none", [x.at(middle), TOP], [x.at(middle), floor]));
    }
    for (index, row) in rows.iter().enumerate() {
        let y = TOP + ROW * (index as f64 + 0.5);
        svg = svg.child(text_at("name", [LEFT - 12.0, y + 4.0], "end", &row.name));
        let mut drawn =
            node("g").class(row.class).child(node("title").text(format!("{}: {}", row.name, row.value_text)));
        if let Some([low, high]) = row.interval.map(|ends| ends.map(|end| x.at(end))) {
            drawn = drawn.child(line("range", [low, y], [high, y]));
            for end in [low, high] {
                drawn = drawn.child(line("range", [end, y - 4.0], [end, y + 4.0]));
            }
        }
        svg = svg.child(drawn.child(circle("point", [x.at(row.value), y], 4.5)));
        svg = svg.child(text_at("tick", [RIGHT + 12.0, y + 4.0], "start", &row.value_text));
    }
    let unit = text_at("tick", [RIGHT, floor + 29.0], "end", scale.unit);
    svg.child(line("axis", [LEFT, floor], [RIGHT, floor])).child(unit)
}

pub struct ValueRange {
    pub name: String,
    pub class: &'static str,
    /// Minimum, 5 %, median, 95 %, maximum; NaN if nothing was measured.
    pub marks: [f64; 5],
}

/// Chart on an axis from `low` to `high`; `ends` are the labels of its two ends.
pub fn ranges(label: &str, rows: &[ValueRange], [low, high]: [f64; 2], ends: [&str; 2]) -> Node {
    const WIDTH: f64 = 340.0;
    const ROW: f64 = 18.0;
    const TOP: f64 = 6.0;
    const LEFT: f64 = 104.0;
    const RIGHT: f64 = 332.0;
    let x = Scale { low, high, from: LEFT, to: RIGHT };
    let floor = TOP + ROW * rows.len() as f64;
    let mut svg = drawing(WIDTH, floor + 34.0, label);
    for tick in x.ticks(4) {
        let at = x.at(tick);
        let class = if tick.abs() < 1e-9 { "grid zero" } else { "grid" };
        svg = svg.child(line(class, [at, TOP], [at, floor]));
        svg = svg.child(text_at("tick", [at, floor + 14.0], "middle", &number(tick)));
    }
    for (row, range) in rows.iter().enumerate() {
        let y = TOP + ROW * (row as f64 + 0.5);
        svg = svg.child(text_at("name", [LEFT - 8.0, y + 4.0], "end", &range.name));
        if range.marks.iter().any(|mark| mark.is_nan()) {
            svg = svg.child(text_at("tick", [LEFT + 4.0, y + 4.0], "start", "not measured"));
            continue;
        }
        let [lowest, low, median, high, highest] = range.marks.map(|mark| x.at(mark));
        svg = svg
            .child(line(&format!("whisker {}", range.class), [lowest, y], [highest, y]))
            .child(rect(&format!("box {}", range.class), [low, y - 4.5], [(high - low).max(1.0), 9.0]))
            .child(line("median", [median, y - 5.5], [median, y + 5.5]));
    }
    let end = |x: f64, anchor: &str, text: &str| text_at("tick", [x, floor + 29.0], anchor, text);
    svg.child(end(LEFT, "start", ends[0])).child(end(RIGHT, "end", ends[1]))
}
