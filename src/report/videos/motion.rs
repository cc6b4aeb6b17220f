//! Report section with charts of joint positions and speeds.

use super::movement::{MovementCounts, PAIRS};
use crate::html::chart::profile;
use crate::html::chart::ranges::{ValueRange, ranges};
use crate::html::{Node, legend, node};
use orator_base::text::counted;
use orator_base::text::number;

/// Axes with the labels of their ends.
const AXES: [(&str, [&str; 2]); 3] = [
    ("horizontal", ["speaker's right", "speaker's left"]),
    ("vertical", ["up", "down"]),
    ("depth", ["towards the camera", "away"]),
];
const SIDES: [&str; 2] = ["left", "right"];

/// Section with charts of position ranges and speeds.
pub fn motion(movement: &MovementCounts) -> Vec<Node> {
    if movement.n_frames == 0 {
        return vec![node("p").class("empty").text("No accepted and lifted frames: no motion to show.")];
    }
    let about = format!(
        "{} in accepted intervals: arm joints relative to the neck, fingertips relative to the wrist, in metres. Line: \
         minimum to maximum; box: 5th to 95th percentile; notch: median.",
        counted(movement.n_frames, "frame")
    );
    let legend = legend(SIDES.map(|side| (format!("side {side}"), format!("speaker's {side}"))));
    let charts = [("Arms", true), ("Fingertips", false)].into_iter().flat_map(|(name, is_arm)| {
        AXES.iter()
            .enumerate()
            .map(move |(axis, (along, ends))| range_card(movement, name, is_arm, (axis, along, *ends)))
    });
    let speeds = movement.pairs.iter().zip(PAIRS).map(|(joints, pair)| {
        let medians: Vec<String> = SIDES
            .iter()
            .zip(joints)
            .map(|(side, joint)| format!("{side} {} m/s", number((joint.speeds.quantile(0.5) * 100.0).round() / 100.0)))
            .collect();
        let medians = format!("median {}", medians.join(", "));
        let lines: Vec<_> = SIDES.iter().zip(joints).map(|(side, joint)| (*side, &joint.speeds)).collect();
        profile::card(&format!("Speed of the {}", pair.name), "m/s", &lines, medians)
    });
    vec![
        node("p").text(about),
        legend,
        node("div").class("grid").children(charts),
        node("div").class("grid").children(speeds),
    ]
}

fn range_card(
    movement: &MovementCounts,
    name: &str,
    is_arm: bool,
    (axis, along, ends): (usize, &str, [&str; 2]),
) -> Node {
    let pairs = || movement.pairs.iter().zip(PAIRS).filter(move |(_, pair)| pair.is_arm == is_arm);
    let rows: Vec<ValueRange> = pairs()
        .flat_map(|(joints, pair)| {
            joints.iter().zip(SIDES).map(move |(joint, side)| ValueRange {
                name: format!("{} {}", &side[..1].to_uppercase(), pair.name),
                class: side,
                marks: joint.marks(axis),
            })
        })
        .collect();
    // The three axes share one scale, so that they are comparable.
    let all = pairs().flat_map(|(joints, _)| joints).flat_map(|joint| [0, 1, 2].map(|axis| joint.marks(axis)));
    let farthest = all.flatten().filter(|mark| mark.is_finite()).fold(0.05, |a: f64, b| a.max(b.abs()));
    let end = (farthest * 20.0).ceil() / 20.0;
    let title = format!("{name}: {along}");
    node("div").class("card range").child(node("h3").text(&title)).child(ranges(&title, &rows, [-end, end], ends))
}
