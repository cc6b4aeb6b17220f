//! Curve over a few steps with one step marked: the seconds that each value of a threshold would keep.

use super::scale::{Scale, circle, drawing, line, path_data, px, stroke};
use crate::html::node::{Node, node};

const WIDTH: f64 = 300.0;
const HEIGHT: f64 = 56.0;
const TOP: f64 = 6.0;
const FLOOR: f64 = 50.0;
/// Margins that align the first and last step with the thumb of a slider at its ends.
const LEFT: f64 = 8.0;
const RIGHT: f64 = 292.0;

/// Curve of `values` on an axis from 0 to `max`; a script moves the dot from the step `marked` to the positions in
/// `data-xs` and `data-ys`.
pub fn curve(label: &str, values: &[f64], max: f64, marked: usize) -> Node {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_marked_step_is_on_the_line() {
        let drawn = curve("", &[0.0, 5.0, 10.0], 10.0, 1).to_string();
        assert!(drawn.contains("cx=\"150\" cy=\"28\"") && drawn.contains("data-xs=\"8 150 292\""), "{drawn}");
        assert!(curve("", &[], 0.0, 3).to_string().contains("<svg"));
    }
}
