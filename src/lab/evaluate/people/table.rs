//! Table of the errors on rendered persons: a row per condition and model set, and one for all conditions. If some
//! motion is captured, a row per source of motion instead, and one for all captured sources.

use super::accepted::{AcceptedSeconds, MaskCounts};
use super::clips::{self, RenderedClip};
use super::hand_depth::HandDepth;
use super::hands::HandCounts;
use super::head::HeadErrors;
use super::joints::{self, LiftedErrors};
use super::points::{self, PointErrors};
use crate::mocap::captured::source::MotionSource;
use anyhow::Result;
use orator_dataset::config;
use orator_pipeline::lift::Lifter;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Name of the row of all conditions together.
const ALL: &str = "all";
/// Name of the row of all captured sources together.
pub const CAPTURED: &str = "captured";

/// Row of the table.
#[derive(Clone, Debug, Serialize)]
pub struct ConditionRow {
    /// Model set: the name of its configuration without ending.
    pub set: String,
    /// Condition, or source of the motion.
    pub condition: String,
    pub n_clips: usize,
    pub points: Vec<PointErrors>,
    pub hands: HandCounts,
    pub hand_depth: HandDepth,
    pub head: HeadErrors,
    pub seconds: AcceptedSeconds,
    pub mask: MaskCounts,
    pub joints: LiftedErrors,
}

/// Rows of the clips in `dir` for each configuration (a model set), by condition or source in the order of the list,
/// followed by a row for all of them or all captured sources; optionally only clips of `part` and of `sources`.
pub fn table(
    dir: &Path,
    config_files: &[PathBuf],
    part: Option<&str>,
    sources: &[MotionSource],
) -> Result<Vec<ConditionRow>> {
    let mut rows = Vec::new();
    for file in config_files {
        let settings = config::load(file, &[])?.settings;
        let lifter = Lifter::new(&config::LiftConfig { level: false, ..settings.lift })?;
        let clips = clips::read(dir, file, part, sources)?;
        let set = file.file_stem().unwrap_or_default().to_string_lossy();
        let has_captured = clips.iter().any(is_captured);
        let group = |clip: &RenderedClip| if has_captured { clip.source.clone() } else { clip.condition.clone() };
        let mut groups: Vec<String> = Vec::new();
        for name in clips.iter().map(group) {
            if !groups.contains(&name) {
                groups.push(name);
            }
        }
        for name in &groups {
            let of_group: Vec<&RenderedClip> = clips.iter().filter(|clip| group(clip) == *name).collect();
            rows.push(row(&set, name, &of_group, &lifter)?);
        }
        let together: Vec<&RenderedClip> = clips.iter().filter(|clip| !has_captured || is_captured(clip)).collect();
        rows.push(row(&set, if has_captured { CAPTURED } else { ALL }, &together, &lifter)?);
    }
    Ok(rows)
}

fn is_captured(clip: &RenderedClip) -> bool {
    clip.source != MotionSource::Generated.name()
}

fn row(set: &str, condition: &str, clips: &[&RenderedClip], lifter: &Lifter) -> Result<ConditionRow> {
    let (motions, joints) = joints::measure(lifter, clips)?;
    Ok(ConditionRow {
        set: set.to_owned(),
        condition: condition.to_owned(),
        n_clips: clips.len(),
        points: points::errors(clips),
        hands: HandCounts::measure(clips),
        hand_depth: HandDepth::measure(clips),
        head: HeadErrors::measure(clips),
        seconds: AcceptedSeconds::measure(clips),
        mask: MaskCounts::measure(clips.iter().copied().zip(&motions)),
        joints,
    })
}
