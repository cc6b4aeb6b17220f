//! Grid of the sources of motion in one line each, with the difference between captured and generated motion, which
//! otherwise have equal bodies, clothes, cameras and voices.

use super::grid::{Grid, heads, number};
use super::points::PointErrors;
use super::table::{CAPTURED, ConditionRow};
use crate::mocap::captured::source::MotionSource;

/// Column headings, with the number of decimals of the values.
const COLUMNS: [(&str, usize); 14] = [
    ("precision", 1),
    ("recall", 1),
    ("shoulders", 1),
    ("elbows", 1),
    ("missed", 1),
    ("wrong hand", 1),
    ("false pos.", 1),
    ("MPJPE", 0),
    ("elbow", 0),
    ("wrist", 0),
    ("hand", 0),
    ("velocity", 0),
    ("of exact keypoints", 0),
    ("of mean pose", 2),
];

/// The grid; `None` if no motion is captured.
pub fn grid(rows: &[ConditionRow]) -> Option<Grid> {
    let find = |name: &str| rows.iter().find(|row| row.condition == name).map(values);
    let captured = find(CAPTURED)?;
    let cells = |values: [f64; COLUMNS.len()]| -> Vec<String> {
        values.into_iter().zip(COLUMNS).map(|(value, (_, digits))| number(value, digits)).collect()
    };
    let mut lines: Vec<(String, Vec<String>)> =
        rows.iter().map(|row| (row.condition.clone(), cells(values(row)))).collect();
    if let Some(generated) = find(MotionSource::Generated.name()) {
        let difference = std::array::from_fn(|k| captured[k] - generated[k]);
        lines.push(("captured - generated".to_owned(), cells(difference)));
    }
    Some(Grid {
        title: "source of motion",
        note: "Precision and recall of accepted seconds, %; median error of visible 2D points, % of the shoulders; \
               visible hands missed or detected on the other hand, and hidden hands detected, %; 3D errors in mm, \
               MPJPE of the same lifter with exact keypoints, and MPJPE relative to that of the clip's mean pose.",
        heads: heads(&COLUMNS.map(|(name, _)| name)),
        rows: lines,
    })
}

/// Values of a row in the order of `COLUMNS`.
fn values(row: &ConditionRow) -> [f64; COLUMNS.len()] {
    let median = |points: &str| {
        let of = |e: &&PointErrors| e.points == points && e.found > 0.0;
        row.points.iter().find(of).map_or(f64::NAN, |e| e.median)
    };
    let (seconds, hands, joints) = (&row.seconds, &row.hands, &row.joints);
    let [shoulders, elbows] = [median("shoulders"), median("elbows")];
    let of_hands = [hands.missed, hands.other_hand + hands.swapped, hands.false_positives];
    let [missed, other_hand, false_positives] = of_hands.map(|share| 100.0 * share);
    let lifted = &joints.lifted;
    [
        100.0 * seconds.precision,
        100.0 * seconds.recall,
        100.0 * shoulders,
        100.0 * elbows,
        missed,
        other_hand,
        false_positives,
        lifted.mpjpe,
        lifted.elbow,
        lifted.wrist,
        lifted.hand,
        lifted.wrist_velocity,
        joints.of_true_keypoints.mpjpe,
        lifted.mpjpe / joints.mean_pose.mpjpe,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::people::hand_depth::HandDepth;
    use crate::evaluate::people::joints::{JointErrors, LiftedErrors};
    use crate::evaluate::people::{accepted, hands, head};

    fn row(condition: &str, mpjpe: f64) -> ConditionRow {
        let joints = |mpjpe: f64| JointErrors { mpjpe, ..JointErrors::default() };
        ConditionRow {
            set: "default".to_owned(),
            condition: condition.to_owned(),
            n_clips: 1,
            points: Vec::new(),
            hands: hands::HandCounts { other_hand: 0.25, ..Default::default() },
            hand_depth: HandDepth::measure(&[]),
            head: head::HeadErrors::default(),
            seconds: accepted::AcceptedSeconds { precision: 0.5, ..Default::default() },
            mask: accepted::MaskCounts::default(),
            joints: LiftedErrors { lifted: joints(mpjpe), of_true_keypoints: joints(30.0), mean_pose: joints(100.0) },
        }
    }

    #[test]
    fn the_difference_is_a_line_of_its_own() {
        assert_eq!(grid(&[row("front", 40.0), row("all", 40.0)]), None);
        let rows = [row("generated", 40.0), row("cmu", 70.0), row(CAPTURED, 75.0)];
        let grid = grid(&rows).unwrap();
        assert_eq!(grid.rows.len(), 4);
        let (name, cells) = &grid.rows[3];
        let cell = |head: &str| cells[grid.heads.iter().position(|name| name == head).unwrap()].as_str();
        assert_eq!((name.as_str(), cell("MPJPE"), cell("of mean pose")), ("captured - generated", "35", "0.35"));
        assert_eq!((cell("precision"), cell("shoulders")), ("0.0", "-"));
        assert_eq!(grid.rows[1].1[5], "25.0");
    }
}
