//! Positions and speeds of joints in accepted frames, and the report section with their charts. Arms are measured
//! relative to the neck, finger tips relative to their wrist.

use crate::html::chart::forest::{ValueRange, ranges};
use crate::html::chart::histogram::{self, Counts};
use crate::html::{Node, legend, node};
use orator_base::text::{counted, number};
use orator_base::types::interval::Interval;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_ELBOW, L_HAND, L_WRIST, NECK, R_ELBOW, R_HAND, R_WRIST};

/// Largest counted distance of a joint from its reference along an axis, metres.
const MAX_DISTANCE: f64 = 1.2;
/// Largest counted speed, m/s.
const MAX_SPEED: f64 = 3.0;

/// Joint on both sides (left, right), with the joints they are measured from.
#[derive(Clone, Copy)]
pub struct JointPair {
    pub name: &'static str,
    joints: [usize; 2],
    from: [usize; 2],
    pub is_arm: bool,
}

const fn tip(name: &'static str, finger: usize) -> JointPair {
    let tip = 4 * finger + 4;
    JointPair { name, joints: [L_HAND + tip, R_HAND + tip], from: [L_WRIST, R_WRIST], is_arm: false }
}

pub const PAIRS: [JointPair; 5] = [
    JointPair { name: "elbow", joints: [L_ELBOW, R_ELBOW], from: [NECK; 2], is_arm: true },
    JointPair { name: "wrist", joints: [L_WRIST, R_WRIST], from: [NECK; 2], is_arm: true },
    tip("thumb tip", 0),
    tip("index tip", 1),
    tip("little tip", 4),
];

/// Positions of a joint by axis (x to the speaker's left, y down, z away from the camera), metres, and its speeds.
pub struct JointMovement {
    positions: [Counts; 3],
    ends: [[f64; 2]; 3],
    /// Speeds, m/s.
    pub speeds: Counts,
}

impl JointMovement {
    fn new() -> Self {
        let positions = || Counts::new(-MAX_DISTANCE, MAX_DISTANCE, 480);
        Self {
            positions: [positions(), positions(), positions()],
            ends: [[f64::INFINITY, f64::NEG_INFINITY]; 3],
            speeds: Counts::new(0.0, MAX_SPEED, 50),
        }
    }

    /// Minimum, 5 %, median, 95 %, maximum along an axis, metres; NaN if the joint was never measured.
    pub fn marks(&self, axis: usize) -> [f64; 5] {
        if self.positions[axis].total() == 0 {
            return [f64::NAN; 5];
        }
        let [lowest, highest] = self.ends[axis];
        let at = |share: f64| self.positions[axis].quantile(share).clamp(lowest, highest);
        [lowest, at(0.05), at(0.5), at(0.95), highest]
    }
}

/// Movement of the left and right joint of every pair.
pub struct MovementCounts {
    pub pairs: Vec<[JointMovement; 2]>,
    pub n_frames: usize,
}

impl MovementCounts {
    pub fn new() -> Self {
        Self { pairs: PAIRS.iter().map(|_| [JointMovement::new(), JointMovement::new()]).collect(), n_frames: 0 }
    }

    /// Counts the frames of a video's accepted intervals.
    pub fn add(&mut self, motion: &Motion, intervals: &[Interval]) {
        let n_frames = motion.n_frames();
        for interval in intervals.iter().filter(|interval| interval.end <= n_frames) {
            self.n_frames += interval.n_frames();
            for (pair, joints) in PAIRS.iter().zip(&mut self.pairs) {
                for (side, joint) in joints.iter_mut().enumerate() {
                    joint.add(motion, *interval, pair.joints[side], pair.from[side]);
                }
            }
        }
    }
}

impl JointMovement {
    fn add(&mut self, motion: &Motion, interval: Interval, joint: usize, from: usize) {
        let mut before: Option<[f64; 3]> = None;
        for t in interval.start..interval.end {
            let at = [0, 1, 2].map(|axis| f64::from(motion.joints[[t, joint, axis]] - motion.joints[[t, from, axis]]));
            if at.iter().any(|v| !v.is_finite()) {
                before = None;
                continue;
            }
            for (axis, value) in at.into_iter().enumerate() {
                self.positions[axis].add(value);
                let [lowest, highest] = &mut self.ends[axis];
                (*lowest, *highest) = (lowest.min(value), highest.max(value));
            }
            if let Some(before) = before {
                let distance = at.iter().zip(before).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
                self.speeds.add(distance * motion.fps.per_sec());
            }
            before = Some(at);
        }
    }
}

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
        histogram::card(&format!("Speed of the {}", pair.name), "m/s", &lines, medians)
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
