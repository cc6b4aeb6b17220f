//! Box plots on one scale: a thin line from minimum to maximum, a box from 5 % to 95 %, a tick at the median.

use super::scale::{Scale, drawing, line, rect, text_at};
use crate::html::node::Node;
use orator_base::text::number;

/// Row of the chart.
pub struct ValueRange {
    pub name: String,
    pub class: &'static str,
    /// Minimum, 5 %, median, 95 %, maximum; NaN if nothing was measured.
    pub marks: [f64; 5],
}

const WIDTH: f64 = 340.0;
const ROW: f64 = 18.0;
const TOP: f64 = 6.0;
const LEFT: f64 = 104.0;
const RIGHT: f64 = 332.0;

/// Chart on an axis from `low` to `high`; `ends` are the labels of its two ends.
pub fn ranges(label: &str, rows: &[ValueRange], [low, high]: [f64; 2], ends: [&str; 2]) -> Node {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_without_a_measurement_is_labelled() {
        let row = |marks| ValueRange { name: "wrist".into(), class: "left", marks };
        let rows = [row([-0.5, -0.2, 0.0, 0.3, 0.6]), row([f64::NAN; 5])];
        let drawn = ranges("", &rows, [-1.0, 1.0], ["left", "right"]).to_string();
        assert_eq!(drawn.matches("class=\"box left\"").count(), 1);
        assert!(drawn.contains("not measured"));
    }
}
