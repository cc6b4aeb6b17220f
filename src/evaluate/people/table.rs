//! The table of rendered people: a row for each condition, model set and all conditions together.

use super::clips::{self, RenderedClip};
use super::hands::HandCounts;
use super::head::HeadErrors;
use super::joints::{self, LiftedErrors};
use super::kept::{KeptSeconds, MaskCounts};
use super::points::{self, PointErrors};
use crate::config;
use crate::pipeline::lift::Lifter;
use anyhow::Result;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Name of the row of all conditions together.
const ALL: &str = "all";

/// Row of the table.
#[derive(Clone, Debug, Serialize)]
pub struct PeopleRow {
    /// Model set: the name of its configuration without ending.
    pub set: String,
    pub condition: String,
    pub n_clips: usize,
    pub points: Vec<PointErrors>,
    pub hands: HandCounts,
    pub head: HeadErrors,
    pub seconds: KeptSeconds,
    pub mask: MaskCounts,
    pub joints: LiftedErrors,
}

/// Rows of the clips in `dir` for each configuration (a model set), by condition in the order of the list, all of them
/// together last; only clips of `part` where one is named.
pub fn table(dir: &Path, config_files: &[PathBuf], part: Option<&str>) -> Result<Vec<PeopleRow>> {
    let mut rows = Vec::new();
    for file in config_files {
        let settings = config::load(file, &[])?.settings;
        let lifter = Lifter::new(&config::LiftConfig { level: false, ..settings.lift })?;
        let clips = clips::read(dir, file, part)?;
        let set = file.file_stem().unwrap_or_default().to_string_lossy();
        let mut conditions: Vec<&str> = Vec::new();
        for clip in &clips {
            if !conditions.contains(&clip.condition.as_str()) {
                conditions.push(&clip.condition);
            }
        }
        for condition in conditions {
            let of_it: Vec<&RenderedClip> = clips.iter().filter(|clip| clip.condition == condition).collect();
            rows.push(row(&set, condition, &of_it, &lifter)?);
        }
        rows.push(row(&set, ALL, &clips.iter().collect::<Vec<_>>(), &lifter)?);
    }
    Ok(rows)
}

fn row(set: &str, condition: &str, clips: &[&RenderedClip], lifter: &Lifter) -> Result<PeopleRow> {
    let (motions, joints) = joints::measure(lifter, clips)?;
    Ok(PeopleRow {
        set: set.to_owned(),
        condition: condition.to_owned(),
        n_clips: clips.len(),
        points: points::errors(clips),
        hands: HandCounts::measure(clips),
        head: HeadErrors::measure(clips),
        seconds: KeptSeconds::measure(clips),
        mask: MaskCounts::measure(clips.iter().copied().zip(&motions)),
        joints,
    })
}

/// Table for people: for each set the 2D errors, the hands, the seconds and the joints by condition.
pub fn text(rows: &[PeopleRow]) -> String {
    let mut text = String::new();
    for of_set in rows.chunk_by(|a, b| a.set == b.set) {
        text += &format!("model set {}\n\n", of_set[0].set);
        text += &points_text(of_set);
        text += &hands_text(of_set);
        text += &kept_text(of_set);
        text += &joints_text(of_set);
    }
    text.trim_end().to_owned()
}

fn points_text(rows: &[PeopleRow]) -> String {
    let heads: String = points::GROUPS.iter().map(|(name, _)| format!("{name:>24}")).collect();
    let mut text = format!("2D, % of the shoulders: median, 95 %, bias, scatter\n{:15}{heads}\n", "");
    for row in rows {
        let cells: String = row
            .points
            .iter()
            .map(|e| {
                let [median, p95, bias, scatter] = [e.median, e.p95, e.bias, e.scatter].map(|v| 100.0 * v);
                if e.n_seen == 0 {
                    format!("{:>24}", "-")
                } else {
                    format!("{median:>9.1}{p95:>5.0}{bias:>5.1}{scatter:>5.1}")
                }
            })
            .collect();
        text += &format!("{:15}{cells}\n", row.condition);
    }
    text + "\n"
}

fn hands_text(rows: &[PeopleRow]) -> String {
    let mut text = format!(
        "{:15}{:>7}{:>8}{:>8}{:>8}{:>8}{:>8}{:>9}{:>8}{:>7}   head: {:>6}{:>7}{:>6}{:>7}\n",
        "hands, %",
        "seen",
        "missed",
        "stolen",
        "swapped",
        "astray",
        "hidden",
        "invented",
        "median",
        "95 %",
        "yaw",
        "pitch",
        "roll",
        "found"
    );
    for PeopleRow { condition, hands: h, head, .. } in rows {
        let [missed, stolen, swapped, astray, invented, median, p95] =
            [h.missed, h.stolen, h.swapped, h.astray, h.invented, h.median, h.p95].map(|v| 100.0 * v);
        text += &format!(
            "{condition:15}{:>7}{missed:>8.1}{stolen:>8.1}{swapped:>8.1}{astray:>8.1}{:>8}{invented:>9.1}{median:>8.1}{p95:>7.0}         {:>6.1}{:>7.1}{:>6.1}{:>7.0}\n",
            h.n_seen,
            h.n_hidden,
            head.yaw,
            head.pitch,
            head.roll,
            100.0 * head.found
        );
    }
    text + "seen, hidden: hands in all frames; median, 95 %: distance of a right hand's points, % of the shoulders; head: mean error, degrees\n\n"
}

fn kept_text(rows: &[PeopleRow]) -> String {
    let mut text = format!(
        "{:15}{:>8}{:>8}{:>14}{:>17}{:>12}{:>8}\n",
        "seconds", "total", "kept", "kept wrongly", "refused wrongly", "mask, %", "recall"
    );
    for PeopleRow { condition, seconds: s, mask: m, .. } in rows {
        text += &format!(
            "{condition:15}{:>8.1}{:>8.1}{:>14.1}{:>17.1}{:>12.1}{:>8.1}\n",
            s.total,
            s.kept,
            s.kept_wrongly,
            s.refused_wrongly,
            100.0 * m.truly_seen,
            100.0 * m.masked
        );
    }
    text + "mask: joints it calls seen that can be seen; recall: joints that can be seen which it calls so\n\n"
}

fn joints_text(rows: &[PeopleRow]) -> String {
    let mut text = format!(
        "{:15}{:20}{:>7}{:>9}{:>7}{:>6}{:>7}{:>6}{:>7}{:>8}\n",
        "3D, mm", "", "MPJPE", "P-MPJPE", "elbow", "|dz|", "wrist", "|dz|", "hand", "frames"
    );
    for row in rows {
        let LiftedErrors { lifted, of_true_keypoints, mean_pose } = row.joints;
        for (name, e) in
            [("the pipeline", lifted), ("exact keypoints", of_true_keypoints), ("clip's mean pose", mean_pose)]
        {
            let condition = if name == "the pipeline" { row.condition.as_str() } else { "" };
            text += &format!(
                "{condition:15}{name:20}{:>7.0}{:>9.0}{:>7.0}{:>6.0}{:>7.0}{:>6.0}{:>7.0}{:>8}\n",
                e.mpjpe, e.p_mpjpe, e.elbow, e.elbow_depth, e.wrist, e.wrist_depth, e.hand, e.n_frames
            );
        }
    }
    text + "\n"
}
