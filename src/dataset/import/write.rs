//! Import in two passes: every item is inspected first (outcome, sound codes), so that splits can be assigned without
//! leaks, then read again and written. Memory: one take, and the codes of all sound.

use super::find;
use super::find::TakeFiles;
use super::plan::{ImportOutcome, ImportPlan};
use super::source::{ImportItem, InspectedItem};
use crate::config;
use crate::dataset::info::DatasetInfo;
use crate::dataset::leakage::SoundComparison;
use crate::dataset::split;
use crate::dataset::split::{Assignment, Unassigned};
use crate::dataset::stats::DatasetStats;
use crate::dataset::write::part;
use crate::dataset::write::writer::DatasetWriter;
use crate::dataset::{INFO, shared_sound};
use crate::mocap::captured::Kind;
use crate::stage::progress::Progress;
use anyhow::{Context, Result, ensure};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Result of an import.
#[derive(Clone, Debug)]
pub struct Imported {
    pub lines: Vec<ImportOutcome>,
    /// Notes on what was left out of tars.
    pub notes: Vec<String>,
    pub info: DatasetInfo,
    pub stats: DatasetStats,
}

/// Frame rate of the first dataset folder among the sources, the default rate of an import.
pub fn rate_of(sources: &[PathBuf]) -> Option<crate::types::time::FrameRate> {
    let info = sources.iter().find_map(|source| std::fs::read(source.join(INFO)).ok())?;
    serde_json::from_slice::<DatasetInfo>(&info).ok().map(|info| info.fps)
}

/// Imports into the empty folder `out`.
///
/// # Errors
/// Nothing to import, or nothing kept; files that cannot be written. A failed take is an outcome, not an error.
pub fn import(plan: &ImportPlan, out: &Path, progress: &dyn Progress) -> Result<Imported> {
    let sources = find::find(&plan.sources, plan.kind)?;
    let (mut about, notes) = (plan.about.clone(), notes(&sources.takes));
    about.notes.extend(notes);
    let (origins, left_out) = ImportItem::all(&sources);
    let task = progress.begin("look", origins.len() as u64);
    let mut names = BTreeSet::new();
    let mut looks: Vec<InspectedItem> = Vec::new();
    for origin in &origins {
        task.detail(&origin.file());
        let mut look = origin.look(plan);
        if !names.insert(look.source.name.clone()) {
            look = look.twice(names.len() + looks.len());
            names.insert(look.source.name.clone());
        }
        if let (Some(codes), true) = (&look.codes, look.is_kept()) {
            look.sound = Some(part::write_sound(out, &look.source.name, codes)?);
            look.codes = None;
        }
        looks.push(look);
        task.advance(1);
    }
    drop(task);
    let kept: Vec<usize> = (0..looks.len()).filter(|&at| looks[at].is_kept()).collect();
    ensure!(!kept.is_empty(), "nothing can be imported: {}", first_reasons(&origins, &looks));
    let compared = compare(&looks, &kept, out, plan.dataset.duplicate_secs)?;
    for (&at, placed) in kept.iter().zip(place(&looks, &kept, &compared, &plan.dataset)) {
        match placed {
            Assignment::In(split, by) => looks[at].split = Some((split, by)),
            Assignment::Nowhere(with) => {
                part::remove_sound(out, &looks[at].source.name)?;
                looks[at].refuse_shared(&with, plan.dataset.duplicate_secs);
            }
        }
    }
    let max_shard_bytes = u64::from(plan.dataset.max_mb) << 20;
    let writer = DatasetWriter::new(out, about, max_shard_bytes).with_compared(compared);
    let task = progress.begin("write", origins.len() as u64);
    let mut lines = Vec::new();
    for (origin, look) in origins.iter().zip(&looks) {
        task.detail(&origin.file());
        origin.write(look, plan, &writer, out).with_context(|| format!("importing {}", origin.file()))?;
        lines.push(look.line(&origin.file()));
        task.advance(1);
    }
    let (info, stats) = writer.finish()?;
    Ok(Imported { lines, notes: left_out, info, stats })
}

fn compare(looks: &[InspectedItem], kept: &[usize], out: &Path, duplicate_secs: f64) -> Result<SoundComparison> {
    if duplicate_secs <= 0.0 {
        return Ok(SoundComparison::default());
    }
    let audible = kept.iter().filter(|&&at| looks[at].sound.is_some());
    let mut names: Vec<String> = audible.map(|&at| looks[at].source.name.clone()).collect();
    names.sort();
    let shared = shared_sound::find(&names, |n| part::read_sound(out, &names[n]), duplicate_secs)?;
    Ok(SoundComparison { duplicate_secs, shared })
}

/// Assigns each kept video to a split; one of a dataset keeps its split.
fn place(
    looks: &[InspectedItem],
    kept: &[usize],
    compared: &SoundComparison,
    settings: &config::DatasetConfig,
) -> Vec<Assignment> {
    let waiting = kept.iter().map(|&at| {
        let InspectedItem { source, split, .. } = &looks[at];
        // Without a content hash the name decides.
        let content = if source.content.is_empty() { &source.name } else { &source.content };
        Unassigned { name: &source.name, content, named: split.as_ref().map(|(split, _)| *split), before: None }
    });
    let placed = split::assign(&waiting.collect::<Vec<_>>(), &compared.shared, settings.validation, settings.test);
    let as_before = |(at, placed): (&usize, Assignment)| match (&looks[*at].split, placed) {
        (Some((split, by)), _) => Assignment::In(*split, by.clone()),
        (None, placed) => placed,
    };
    kept.iter().zip(placed).map(as_before).collect()
}

/// Notes on the kinds of sources for readers of the dataset.
fn notes(takes: &[TakeFiles]) -> Vec<String> {
    let there: BTreeSet<Kind> = takes.iter().map(|take| take.kind).collect();
    let mut notes: Vec<String> = there
        .into_iter()
        .map(|kind| match kind {
            Kind::Authors => {
                "Joints of the authors' text clips: fingers turned to base first, camera axes as they were."
            }
            Kind::Ted => {
                "Joints of TED Expressive, of a monocular regressor: camera axes as they were, no finger tips."
            }
            Kind::Bvh => {
                "Joints of BVH takes: metres, and each take turned about the vertical as a whole so that over it the \
                 speaker faces the camera (`turned_degrees` in a sample's json)."
            }
            Kind::Shards => "Samples of other datasets of this form, as they were.",
        })
        .map(str::to_owned)
        .collect();
    if !takes.is_empty() {
        notes.push(
            "Imported motion was captured, not seen in a video: pose2d is 0 everywhere. The bones of a take have their \
             median lengths; by how much that moved its joints is in a sample's json (`bones_moved_mm`)."
                .to_owned(),
        );
    }
    notes
}

/// First few reasons why nothing is kept.
fn first_reasons(origins: &[ImportItem], looks: &[InspectedItem]) -> String {
    let mut reasons: BTreeMap<String, usize> = BTreeMap::new();
    let lines = origins.iter().zip(looks).map(|(origin, look)| look.line(&origin.file()));
    let mut said: Vec<String> = Vec::new();
    for line in lines {
        let n = reasons.entry(line.reason.clone()).or_default();
        *n += 1;
        if *n <= 2 {
            said.push(format!("{}: {}", line.file, line.message));
        }
    }
    said.join("; ")
}
