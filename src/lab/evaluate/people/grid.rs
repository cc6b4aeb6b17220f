//! Text grids of the rows of rendered persons: one each for 2D points, for hands and head, for seconds, and for
//! joints.

use super::difference;
use super::joints::LiftedErrors;
use super::points::GROUPS;
use super::table::ConditionRow;

/// Table of text.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    pub title: &'static str,
    /// Meaning of the columns.
    pub note: &'static str,
    /// Column headings, except for the first column.
    pub heads: Vec<String>,
    /// Name of each row, and its cells.
    pub rows: Vec<(String, Vec<String>)>,
}

/// Grids of the rows of one model set.
pub fn grids(rows: &[ConditionRow]) -> Vec<Grid> {
    let grids = [points(rows), hands(rows), seconds(rows), joints(rows)];
    grids.into_iter().chain(difference::grid(rows)).collect()
}

/// Grids of all model sets as text, followed by `last` if given.
pub fn text(rows: &[ConditionRow], last: Option<&Grid>) -> String {
    let of_set = |rows: &[ConditionRow]| {
        let grids: Vec<String> = grids(rows).iter().map(Grid::text).collect();
        format!("model set {}\n\n{}", rows[0].set, grids.join("\n"))
    };
    let sets = rows.chunk_by(|a, b| a.set == b.set).map(of_set);
    sets.chain(last.map(Grid::text)).collect::<Vec<_>>().join("\n")
}

impl Grid {
    fn text(&self) -> String {
        let first = self.rows.iter().map(|(name, _)| name.len()).chain([self.title.len()]).max().unwrap_or(0);
        let column = |k: usize| self.rows.iter().map(|(_, cells)| cells[k].chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> =
            self.heads.iter().enumerate().map(|(k, head)| head.chars().count().max(column(k)) + 2).collect();
        let line = |name: &str, cells: &[String]| {
            let cells: String = cells.iter().zip(&widths).map(|(cell, &width)| format!("{cell:>width$}")).collect();
            format!("{name:first$}{cells}\n")
        };
        let rows: String = self.rows.iter().map(|(name, cells)| line(name, cells)).collect();
        format!("{}{rows}{}\n", line(self.title, &self.heads), self.note)
    }
}

pub fn heads(names: &[&str]) -> Vec<String> {
    names.iter().map(|&name| name.to_owned()).collect()
}

/// A number with `digits` decimals; a dash if it is not finite.
pub fn number(value: f64, digits: usize) -> String {
    if value.is_finite() { format!("{value:.digits$}") } else { "-".to_owned() }
}

/// A share as percent; a dash if it is not finite.
pub fn percent(share: f64) -> String {
    number(100.0 * share, 1)
}

fn points(rows: &[ConditionRow]) -> Grid {
    let cells = |row: &ConditionRow| {
        let cell = |k: usize| {
            let e = &row.points[k];
            let numbers = [e.median, e.p95, e.bias, e.scatter].map(percent);
            if e.n_visible == 0 || e.found == 0.0 { "-".to_owned() } else { numbers.join(" / ") }
        };
        (row.condition.clone(), (0..GROUPS.len()).map(cell).collect())
    };
    Grid {
        title: "2D points",
        note: "Error of visible points, % of the shoulder width: median / 95th percentile / bias (mean error of a \
               clip) / scatter (median distance from the bias).",
        heads: GROUPS.iter().map(|(name, _)| (*name).to_owned()).collect(),
        rows: rows.iter().map(cells).collect(),
    }
}

fn hands(rows: &[ConditionRow]) -> Grid {
    let cells = |ConditionRow { condition, hands: h, hand_depth, head, .. }: &ConditionRow| {
        let mut cells = vec![h.n_visible.to_string()];
        cells.extend([h.missed, h.other_hand, h.swapped, h.misplaced].map(percent));
        cells.push(h.n_hidden.to_string());
        cells.extend([h.false_positives, h.median, h.p95].map(percent));
        cells.extend([hand_depth.hand, hand_depth.forearm].map(|correlation| number(correlation, 2)));
        cells.extend([head.yaw, head.pitch, head.roll].map(|degrees| number(degrees, 1)));
        cells.push(percent(head.found));
        (condition.clone(), cells)
    };
    Grid {
        title: "hands and head",
        note: "Visible hands in all frames, and % of them missed, detected on the other hand, swapped, misplaced; \
               hidden hands, and % of them detected (false positives); error of the points of correct hands, % of the \
               shoulder width. Depth: correlation of the depth of the hand model's direction with that of the true \
               hand and forearm. Head: mean absolute error of the angles, degrees, and % of the frames with angles.",
        heads: heads(&[
            "visible",
            "missed",
            "hand of the other side",
            "swapped",
            "misplaced",
            "hidden",
            "false pos.",
            "median",
            "95 %",
            "depth: hand",
            "forearm",
            "yaw",
            "pitch",
            "roll",
            "detected",
        ]),
        rows: rows.iter().map(cells).collect(),
    }
}

fn seconds(rows: &[ConditionRow]) -> Grid {
    let cells = |ConditionRow { condition, seconds: s, mask: m, .. }: &ConditionRow| {
        let mut cells: Vec<String> =
            [s.total, s.accepted, s.false_accepts, s.false_rejects].map(|secs| number(secs, 1)).into();
        cells.extend([s.precision, s.recall, m.visible_share, m.masked].map(percent));
        (condition.clone(), cells)
    };
    Grid {
        title: "seconds",
        note: "False accepts: a hand is a false positive, on the other hand, swapped or misplaced, or an arm point is \
               far off; false rejects: both hands and arms are visible and correct; precision and recall of the \
               accepted seconds in %. Mask precision: % of the joints marked visible that are visible; recall: % of \
               the visible joints that are marked visible.",
        heads: heads(&[
            "total",
            "accepted",
            "false accepts",
            "false rejects",
            "precision",
            "recall",
            "mask precision",
            "mask recall",
        ]),
        rows: rows.iter().map(cells).collect(),
    }
}

fn joints(rows: &[ConditionRow]) -> Grid {
    let lines = |row: &ConditionRow| {
        let LiftedErrors { lifted, of_true_keypoints, mean_pose } = row.joints;
        let named = [
            (row.condition.clone(), lifted),
            ("  exact keypoints".to_owned(), of_true_keypoints),
            ("  mean pose of the clip".to_owned(), mean_pose),
        ];
        named.map(|(name, e)| {
            let body = [e.mpjpe, e.p_mpjpe, e.elbow, e.elbow_depth, e.wrist, e.wrist_depth];
            let errors = body.into_iter().chain([e.wrist_velocity, e.hand, e.hand_depth]).chain(e.of_neck);
            (name, errors.map(|mm| number(mm, 0)).chain([e.n_frames.to_string()]).collect())
        })
    };
    Grid {
        title: "3D joints, mm",
        note: "Errors of shoulders, elbows and wrists relative to the midpoint of the shoulders in accepted frames, one \
               scale factor per 60 frames; |dz|: along the line of sight; velocity: wrists, mm per frame; hand: \
               fingers relative to their wrist. Neck: relative to the neck joint of each skeleton.",
        heads: heads(&[
            "MPJPE",
            "P-MPJPE",
            "elbow",
            "|dz|",
            "wrist",
            "|dz|",
            "velocity",
            "hand",
            "|dz|",
            "neck: MPJPE",
            "elbow",
            "wrist",
            "frames",
        ]),
        rows: rows.iter().flat_map(lines).collect(),
    }
}
