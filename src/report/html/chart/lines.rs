//! Line chart over training steps, with horizontal lines for comparison and one step marked; and curve of the seconds
//! that each value of a threshold would keep.

use super::scale::{Scale, circle, drawing, line, path_data, px, stroke, text_at};
use crate::html::node::{Node, legend, node};
use orator_base::text::number;

const WIDTH: f64 = 360.0;
const HEIGHT: f64 = 190.0;
const TOP: f64 = 12.0;
const FLOOR: f64 = 160.0;
const LEFT: f64 = 44.0;
const RIGHT: f64 = 350.0;

#[derive(Clone, Debug, Default)]
pub struct LineChart {
    pub title: String,
    /// Sentence under the title; may be empty.
    pub description: String,
    pub lines: Vec<ChartLine>,
    /// Horizontal lines across the whole width.
    pub levels: Vec<ChartLevel>,
    pub marked: Option<f64>,
}

#[derive(Clone, Debug)]
pub struct ChartLine {
    pub name: String,
    /// Index of the colour.
    pub colour: usize,
    /// Step and value of each point, sorted by step; non-finite points are skipped.
    pub points: Vec<[f64; 2]>,
}

#[derive(Clone, Debug)]
pub struct ChartLevel {
    pub name: String,
    pub colour: usize,
    pub value: f64,
}

impl LineChart {
    /// Whether the chart has no finite point.
    pub fn is_empty(&self) -> bool {
        self.points().next().is_none()
    }

    /// Ranges of the axes: first to last step with the marked one, and 0 (or the smallest value below) to the largest.
    pub fn ranges(&self) -> [[f64; 2]; 2] {
        let levels = self.levels.iter().map(|level| level.value).filter(|value| value.is_finite());
        let range_of = |values: &mut dyn Iterator<Item = f64>, low: f64| {
            values.fold([low, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
        };
        let steps = range_of(&mut self.points().map(|[step, _]| step).chain(self.marked), f64::INFINITY);
        let values = range_of(&mut self.points().map(|[_, value]| value).chain(levels), 0.0);
        [steps, values]
            .map(|[low, high]| if high > low { [low, high] } else { [low.min(0.0), low.max(0.0) + 1.0] })
            .map(|range| if range.iter().all(|v| v.is_finite()) { range } else { [0.0, 1.0] })
    }

    /// Round numbers for the value axis.
    fn ticks(&self) -> Vec<f64> {
        let [_, [low, high]] = self.ranges();
        Scale { low, high, from: 0.0, to: 1.0 }.ticks(4)
    }

    /// Card with title, description, drawing and legend.
    pub fn card(&self) -> Node {
        let mut card = node("div").class("card chart").child(node("h3").text(&self.title));
        if !self.description.is_empty() {
            card = card.child(node("p").class("small").text(&self.description));
        }
        let lines = self.lines.iter().map(|line| (format!("drawn colour-{}", line.colour), &line.name));
        let levels = self.levels.iter().map(|level| (format!("level colour-{}", level.colour), &level.name));
        card.child(self.svg()).child(legend(lines.chain(levels)))
    }

    fn svg(&self) -> Node {
        let [[first, last], [low, high]] = self.ranges();
        let x = Scale { low: first, high: last, from: LEFT, to: RIGHT };
        let y = Scale { low, high, from: FLOOR, to: TOP };
        let mut svg = drawing(WIDTH, HEIGHT, &format!("{} by training step", self.title));
        for tick in self.ticks() {
            svg = svg.child(line("grid", [LEFT, y.at(tick)], [RIGHT, y.at(tick)]));
            svg = svg.child(text_at("tick", [LEFT - 6.0, y.at(tick) + 4.0], "end", &number(tick)));
        }
        for tick in x.ticks(4) {
            svg = svg.child(text_at("tick", [x.at(tick), FLOOR + 16.0], "middle", &number(tick)));
        }
        svg = svg.child(line("axis", [LEFT, FLOOR], [RIGHT, FLOOR]));
        if let Some(step) = self.marked {
            svg = svg.child(line("configured", [x.at(step), TOP], [x.at(step), FLOOR]));
        }
        for level in self.levels.iter().filter(|level| level.value.is_finite()) {
            let class = format!("level colour-{}", level.colour);
            svg = svg.child(line(&class, [LEFT, y.at(level.value)], [RIGHT, y.at(level.value)]));
        }
        for drawn in &self.lines {
            let finite = drawn.points.iter().filter(|point| point.iter().all(|v| v.is_finite()));
            let points: Vec<[f64; 2]> = finite.map(|[step, value]| [x.at(*step), y.at(*value)]).collect();
            if !points.is_empty() {
                svg = svg.child(stroke(&format!("colour-{}", drawn.colour), points.iter().copied()));
            }
            if let ([only], 1) = (&points[..], drawn.points.len()) {
                svg = svg.child(circle(&format!("dot colour-{}", drawn.colour), *only, 3.0));
            }
        }
        svg
    }

    fn points(&self) -> impl Iterator<Item = [f64; 2]> {
        let all = self.lines.iter().flat_map(|line| line.points.iter().copied());
        all.filter(|point| point.iter().all(|v| v.is_finite()))
    }
}

/// Curve of `values` from 0 to `max`; a script moves the dot from step `marked` to those in `data-xs` and `data-ys`.
pub fn curve(label: &str, values: &[f64], max: f64, marked: usize) -> Node {
    const WIDTH: f64 = 300.0;
    const HEIGHT: f64 = 56.0;
    const TOP: f64 = 6.0;
    const FLOOR: f64 = 50.0;
    // These margins align the first and last step with the thumb of a slider at its ends.
    const LEFT: f64 = 8.0;
    const RIGHT: f64 = 292.0;
    let x = Scale { low: 0.0, high: values.len().saturating_sub(1) as f64, from: LEFT, to: RIGHT };
    let y = Scale { low: 0.0, high: max.max(1e-9), from: FLOOR, to: TOP };
    let points: Vec<[f64; 2]> = values.iter().enumerate().map(|(i, &value)| [x.at(i as f64), y.at(value)]).collect();
    let at = points.get(marked).copied().unwrap_or([LEFT, FLOOR]);
    let all = |axis: usize| points.iter().map(|point| px(point[axis])).collect::<Vec<_>>().join(" ");
    let outline = path_data(points.iter().copied().chain([[RIGHT, FLOOR], [LEFT, FLOOR]])) + "Z";
    drawing(WIDTH, HEIGHT, label)
        .class("curve")
        .attr("data-xs", all(0))
        .attr("data-ys", all(1))
        .child(node("path").class("area").attr("d", outline))
        .child(stroke("", points))
        .child(line("axis", [LEFT, FLOOR], [RIGHT, FLOOR]))
        .child(line("configured", [at[0], TOP], [at[0], FLOOR]))
        .child(circle("dot", at, 4.5))
}
