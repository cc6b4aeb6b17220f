//! Text grids of the rows of rendered persons: one each for 2D points, for hands and head, for seconds, and for
//! joints.

use super::joints::LiftedErrors;
use super::points::GROUPS;
use super::table::PeopleRow;

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
pub fn grids(rows: &[PeopleRow]) -> Vec<Grid> {
    vec![points(rows), hands(rows), seconds(rows), joints(rows)]
}

/// Grids of all model sets as text, followed by `last` if given.
pub fn text(rows: &[PeopleRow], last: Option<&Grid>) -> String {
    let of_set = |rows: &[PeopleRow]| {
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

fn heads(names: &[&str]) -> Vec<String> {
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

fn points(rows: &[PeopleRow]) -> Grid {
    let cells = |row: &PeopleRow| {
        let cell = |k: usize| {
            let e = &row.points[k];
            let numbers = [e.median, e.p95, e.bias, e.scatter].map(percent);
            if e.n_seen == 0 || e.found == 0.0 { "-".to_owned() } else { numbers.join(" / ") }
        };
        (row.condition.clone(), (0..GROUPS.len()).map(cell).collect())
    };
    Grid {
        title: "2D points",
        note: "Distance of points that can be seen from the truth, % of the shoulder width: median / 95 % / bias (mean error of a clip) / scatter (median about it).",
        heads: GROUPS.iter().map(|(name, _)| (*name).to_owned()).collect(),
        rows: rows.iter().map(cells).collect(),
    }
}

fn hands(rows: &[PeopleRow]) -> Grid {
    let cells = |PeopleRow { condition, hands: h, head, .. }: &PeopleRow| {
        let mut cells = vec![h.n_seen.to_string()];
        cells.extend([h.missed, h.stolen, h.swapped, h.astray].map(percent));
        cells.push(h.n_hidden.to_string());
        cells.extend([h.invented, h.median, h.p95].map(percent));
        cells.extend([head.yaw, head.pitch, head.roll].map(|degrees| number(degrees, 1)));
        cells.push(percent(head.found));
        (condition.clone(), cells)
    };
    Grid {
        title: "hands and head",
        note: "Hands that can be seen, in all frames, and % of them missed, stolen (the other hand's points), swapped, astray; hidden hands and % of them invented; distance of a right hand's points, % of the shoulder width. Head: mean error of its angles, degrees, and % of the frames with angles.",
        heads: heads(&[
            "seen", "missed", "stolen", "swapped", "astray", "hidden", "invented", "median", "95 %", "yaw", "pitch",
            "roll", "found",
        ]),
        rows: rows.iter().map(cells).collect(),
    }
}

fn seconds(rows: &[PeopleRow]) -> Grid {
    let cells = |PeopleRow { condition, seconds: s, mask: m, .. }: &PeopleRow| {
        let mut cells: Vec<String> =
            [s.total, s.kept, s.kept_wrongly, s.refused_wrongly].map(|secs| number(secs, 1)).into();
        cells.extend([m.truly_seen, m.masked].map(percent));
        (condition.clone(), cells)
    };
    Grid {
        title: "seconds",
        note: "Wrongly kept: a hand is invented, stolen, swapped or astray, or a point of an arm far off; wrongly refused: all is seen and right. Mask: % of the joints it calls seen that can be seen; recall: % of those that can be seen which it calls so.",
        heads: heads(&["total", "kept", "kept wrongly", "refused wrongly", "mask", "recall"]),
        rows: rows.iter().map(cells).collect(),
    }
}

fn joints(rows: &[PeopleRow]) -> Grid {
    let lines = |row: &PeopleRow| {
        let LiftedErrors { lifted, of_true_keypoints, mean_pose } = row.joints;
        let named = [
            (row.condition.clone(), lifted),
            ("  exact keypoints".to_owned(), of_true_keypoints),
            ("  clip's mean pose".to_owned(), mean_pose),
        ];
        named.map(|(name, e)| {
            let errors = [e.mpjpe, e.p_mpjpe, e.elbow, e.elbow_depth, e.wrist, e.wrist_depth, e.hand];
            (name, errors.map(|mm| number(mm, 0)).into_iter().chain([e.n_frames.to_string()]).collect())
        })
    };
    Grid {
        title: "3D joints, mm",
        note: "Errors of shoulders, elbows and wrists about the neck in kept frames, one scale for every 60 frames; |dz|: along the line of sight; hand: fingers about their wrist.",
        heads: heads(&["MPJPE", "P-MPJPE", "elbow", "|dz|", "wrist", "|dz|", "hand", "frames"]),
        rows: rows.iter().flat_map(lines).collect(),
    }
}
