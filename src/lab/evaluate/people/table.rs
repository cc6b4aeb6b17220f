//! Table of the errors on rendered persons: a row per condition and model set, and one for all conditions.

use super::accepted::{AcceptedSeconds, MaskCounts};
use super::clips::{self, RenderedClip};
use super::hands::HandCounts;
use super::head::HeadErrors;
use super::joints::{self, LiftedErrors};
use super::points::{self, PointErrors};
use anyhow::Result;
use orator_dataset::config;
use orator_pipeline::lift::Lifter;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Name of the row of all conditions together.
const ALL: &str = "all";

/// Row of the table.
#[derive(Clone, Debug, Serialize)]
pub struct ConditionRow {
    /// Model set: the name of its configuration without ending.
    pub set: String,
    pub condition: String,
    pub n_clips: usize,
    pub points: Vec<PointErrors>,
    pub hands: HandCounts,
    pub head: HeadErrors,
    pub seconds: AcceptedSeconds,
    pub mask: MaskCounts,
    pub joints: LiftedErrors,
}

/// Rows of the clips in `dir` for each configuration (a model set), by condition in the order of the list, followed by
/// a row for all conditions; optionally only clips of `part`.
pub fn table(dir: &Path, config_files: &[PathBuf], part: Option<&str>) -> Result<Vec<ConditionRow>> {
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
            let of_condition: Vec<&RenderedClip> = clips.iter().filter(|clip| clip.condition == condition).collect();
            rows.push(row(&set, condition, &of_condition, &lifter)?);
        }
        rows.push(row(&set, ALL, &clips.iter().collect::<Vec<_>>(), &lifter)?);
    }
    Ok(rows)
}

fn row(set: &str, condition: &str, clips: &[&RenderedClip], lifter: &Lifter) -> Result<ConditionRow> {
    let (motions, joints) = joints::measure(lifter, clips)?;
    Ok(ConditionRow {
        set: set.to_owned(),
        condition: condition.to_owned(),
        n_clips: clips.len(),
        points: points::errors(clips),
        hands: HandCounts::measure(clips),
        head: HeadErrors::measure(clips),
        seconds: AcceptedSeconds::measure(clips),
        mask: MaskCounts::measure(clips.iter().copied().zip(&motions)),
        joints,
    })
}
