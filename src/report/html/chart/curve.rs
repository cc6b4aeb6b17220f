//! Line over a few steps with one step marked: what each value of a threshold would keep.

use super::scale::{Scale, circle, drawing, line, px, stroke, through};
use crate::html::node::{Node, node};

const WIDTH: f64 = 300.0;
const HEIGHT: f64 = 56.0;
/// Margins that put the first and last step under a slider's thumb at its ends.
const TOP: f64 = 6.0;
const FLOOR: f64 = 50.0;
const LEFT: f64 = 8.0;
const RIGHT: f64 = 292.0;

/// Curve of `values` from 0 to `most`; a script moves the line and dot of the step `marked` (`data-xs`, `data-ys`).
pub fn curve(label: &str, values: &[f64], most: f64, marked: usize) -> Node {
    let x = Scale { low: 0.0, high: values.len().saturating_sub(1) as f64, from: LEFT, to: RIGHT };
    let y = Scale { low: 0.0, high: most.max(1e-9), from: FLOOR, to: TOP };
    let places: Vec<[f64; 2]> = values.iter().enumerate().map(|(i, &value)| [x.at(i as f64), y.at(value)]).collect();
    let at = places.get(marked).copied().unwrap_or([LEFT, FLOOR]);
    let all = |axis: usize| places.iter().map(|place| px(place[axis])).collect::<Vec<_>>().join(" ");
    let outline = through(places.iter().copied().chain([[RIGHT, FLOOR], [LEFT, FLOOR]])) + "Z";
    drawing(WIDTH, HEIGHT, label)
        .class("curve")
        .attr("data-xs", all(0))
        .attr("data-ys", all(1))
        .child(node("path").class("area").attr("d", outline))
        .child(stroke("", places))
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
