//! Import in two passes: all items are inspected first (outcome, sound codes), so that splits can be assigned without
//! leaks, then each item is read again and written. Memory: one take, and the codes of all sound.

use super::find::{self, TakeFiles};
use super::genea;
use super::source::{ImportItem, InspectedItem};
use super::unpack::unpack_motion;
use crate::config::{self, SplitUnit};
use crate::import::take::TakeLimits;
use crate::info::{About, DatasetInfo};
use crate::leakage::SoundComparison;
use crate::split::{self, Assignment, RecordedSplit, SplitBy, SplitPlan, SplitRule, Unassigned, blocks};
use crate::stats::DatasetStats;
use crate::write::assemble::DatasetWriter;
use crate::write::entry;
use crate::{INFO, file_name, shared_sound};
use anyhow::{Context, Result, ensure};
use orator_base::input;
use orator_base::stage::ledger::Ledger;
use orator_base::stage::progress::Progress;
use orator_base::text::{counted, first_three};
use orator_formats::mocap::captured::MotionKind;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

#[derive(Clone, Debug)]
pub struct Imported {
    pub lines: Vec<ImportOutcome>,
    /// Notes on files skipped in folders and tar files.
    pub notes: Vec<String>,
    pub info: DatasetInfo,
    pub stats: DatasetStats,
}

/// Frame rate of the first dataset folder among the sources, the default rate of an import.
pub fn rate_of(sources: &[PathBuf]) -> Option<orator_base::types::time::FrameRate> {
    let info = sources.iter().find_map(|source| input::read(source.join(INFO), input::MAX_TEXT).ok())?;
    serde_json::from_slice::<DatasetInfo>(&info).ok().map(|info| info.fps)
}

/// Note for readers of a dataset imported without sound.
const NO_SOUND: &str =
    "There is no sound: silence stands in its place. The motion serves lifters and evaluation, not speech to gesture.";

/// Imports the sources of `plan` into the empty folder `out`.
///
/// # Errors
/// Nothing to import, or nothing kept; files that cannot be written. A failed take is an outcome, not an error.
pub fn import(plan: &ImportPlan, out: &Path, progress: &dyn Progress) -> Result<Imported> {
    let mut sources = find::find(&plan.sources, plan.kind)?;
    let unpacked = out.join("unpacked");
    if plan.kind != Some(MotionKind::Shards) {
        unpack_motion(&mut sources, plan.kind, &unpacked)?;
    }
    if let Some(id) = plan.speaker_id {
        sources.notes.extend(genea::filter_speaker(&mut sources.takes, id)?);
    }
    let (mut about, notes) = (plan.about.clone(), notes(&sources.takes));
    about.notes.extend(notes);
    about.no_sound = plan.limits.no_sound;
    if about.no_sound {
        about.notes.push(NO_SOUND.to_owned());
    }
    let (items, mut left_out) = ImportItem::all(&sources);
    left_out.extend(passed_over(&sources.passed_over));
    left_out.extend(sources.notes.iter().cloned());
    let task = progress.begin("inspect", items.len() as u64);
    let mut names = BTreeSet::new();
    let mut inspected: Vec<InspectedItem> = Vec::new();
    for item in &items {
        task.detail(&item.file());
        let mut one = item.inspect(plan);
        if one.is_accepted() && !names.insert(one.source.name.clone()) {
            one = one.reject_duplicate_name();
        }
        if let (Some(codes), true) = (&one.codes, one.is_accepted()) {
            one.sound = Some(entry::write_sound(out, &one.source.name, codes)?);
            one.codes = None;
        }
        inspected.push(one);
        task.advance(1);
    }
    drop(task);
    // Accepted items keep their names; failed and rejected ones are renamed if theirs is in use. The numbers are even,
    // so that the names equal those of earlier versions.
    for (nth, one) in inspected.iter_mut().enumerate().filter(|(_, one)| !one.is_accepted()) {
        while !names.insert(one.source.name.clone()) {
            one.rename(2 * nth);
        }
    }
    let accepted: Vec<usize> = (0..inspected.len()).filter(|&at| inspected[at].is_accepted()).collect();
    ensure!(!accepted.is_empty(), "nothing can be imported: {}", first_reasons(&items, &inspected));
    let compared = compare(&inspected, &accepted, out, plan.dataset.duplicate_secs)?;
    for (&at, assigned) in accepted.iter().zip(assign(&inspected, &accepted, &compared, &plan.dataset)) {
        match assigned {
            Assignment::In(..) | Assignment::Blocks(_) => inspected[at].split = Some(assigned),
            Assignment::Excluded(with) => {
                entry::remove_sound(out, &inspected[at].source.name)?;
                inspected[at].reject_shared(&with, plan.dataset.duplicate_secs);
            }
        }
    }
    about.split_rule = Some(rule(&inspected));
    let max_shard_bytes = u64::from(plan.dataset.max_mb) << 20;
    let writer = DatasetWriter::new(out, about, max_shard_bytes).with_compared(compared);
    let task = progress.begin("write", items.len() as u64);
    let mut lines = Vec::new();
    for (item, inspected) in items.iter().zip(&inspected) {
        task.detail(&item.file());
        item.write(inspected, plan, &writer, out).with_context(|| format!("importing {}", item.file()))?;
        lines.push(inspected.line(&item.file()));
        task.advance(1);
    }
    if unpacked.exists() {
        fs::remove_dir_all(&unpacked).with_context(|| format!("cannot remove {}", unpacked.display()))?;
    }
    let (info, stats) = writer.finish()?;
    Ok(Imported { lines, notes: left_out, info, stats })
}

fn compare(
    inspected: &[InspectedItem],
    accepted: &[usize],
    out: &Path,
    duplicate_secs: f64,
) -> Result<SoundComparison> {
    if duplicate_secs <= 0.0 {
        return Ok(SoundComparison::default());
    }
    let audible = accepted.iter().filter(|&&at| inspected[at].sound.is_some());
    let mut names: Vec<String> = audible.map(|&at| inspected[at].source.name.clone()).collect();
    names.sort();
    let shared = shared_sound::find(&names, |n| entry::read_sound(out, &names[n]), duplicate_secs)?;
    Ok(SoundComparison { duplicate_secs, shared })
}

/// Assigns each accepted video to a split; a video of another dataset keeps its split or its blocks.
fn assign(
    inspected: &[InspectedItem],
    accepted: &[usize],
    compared: &SoundComparison,
    settings: &config::DatasetConfig,
) -> Vec<Assignment> {
    let recorded: Vec<Option<RecordedSplit>> = accepted.iter().map(|&at| recorded(&inspected[at])).collect();
    let unassigned = accepted.iter().zip(&recorded).map(|(&at, recorded)| {
        let InspectedItem { source, split, .. } = &inspected[at];
        // Without a content hash, the name breaks ties.
        let content = if source.content.is_empty() { &source.name } else { &source.content };
        let named = match split {
            Some(Assignment::In(split, _)) => Some(*split),
            Some(Assignment::Blocks(_) | Assignment::Excluded(_)) | None => None,
        };
        let (duration_secs, accepted) = (source.ledger.duration_secs, spans(&source.ledger));
        Unassigned { name: &source.name, content, duration_secs, accepted, named, recorded: recorded.as_ref() }
    });
    let config::DatasetConfig { validation, test, .. } = *settings;
    let plan = SplitPlan { unit: SplitUnit::Video, validation, test, guard_secs: 0.0, min_block_secs: 0.0 };
    let assigned = split::assign(&unassigned.collect::<Vec<_>>(), &compared.shared, &plan);
    let stated_or_assigned = |(at, assigned): (&usize, Assignment)| inspected[*at].split.clone().unwrap_or(assigned);
    accepted.iter().zip(assigned).map(stated_or_assigned).collect()
}

/// Recorded blocks of an item whose source states several splits.
fn recorded(item: &InspectedItem) -> Option<RecordedSplit> {
    match &item.split {
        Some(Assignment::Blocks(blocks)) => {
            let (name, blocks) = (item.source.name.clone(), blocks.clone());
            Some(RecordedSplit { name, split: None, by: SplitBy::Time, blocks })
        }
        Some(Assignment::In(..) | Assignment::Excluded(_)) | None => None,
    }
}

fn spans(ledger: &Ledger) -> Vec<(f64, f64)> {
    ledger.accepted.iter().map(|accepted| (accepted.start_secs, accepted.end_secs)).collect()
}

/// Split rule of the imported dataset: by time if any source dataset was divided by time, otherwise by whole videos.
fn rule(inspected: &[InspectedItem]) -> SplitRule {
    let mut guard_secs: Option<f64> = None;
    let mut unit = SplitUnit::Video;
    for item in inspected {
        if let Some(Assignment::Blocks(blocks)) = &item.split {
            unit = SplitUnit::Time;
            let gap = blocks::min_gap(blocks, &spans(&item.source.ledger));
            guard_secs = [guard_secs, gap].into_iter().flatten().min_by(f64::total_cmp);
        }
    }
    let why = if unit == SplitUnit::Time { "as the imported datasets are" } else { "imported takes are whole" };
    SplitRule { unit, why: why.to_owned(), guard_secs: guard_secs.unwrap_or(0.0) }
}

/// Notes for readers of the dataset on the kinds of imported sources.
fn notes(takes: &[TakeFiles]) -> Vec<String> {
    let kinds: BTreeSet<MotionKind> = takes.iter().map(|take| take.kind).collect();
    let mut notes: Vec<String> = kinds
        .into_iter()
        .map(|kind| match kind {
            MotionKind::Authors => {
                "Joints of the authors' text clips: fingers turned to base first, camera axes as they were."
            }
            MotionKind::Ted => {
                "Joints of TED Expressive, of a monocular regressor: camera axes as they were, no finger tips."
            }
            MotionKind::Bvh => {
                "Joints of BVH takes: metres, and each take turned about the vertical as a whole so that over it the \
                 speaker faces the camera (`turned_degrees` in a sample's json)."
            }
            MotionKind::Smplx => {
                "Joints of SMPL-X or SMPL-H rotations, on the proportions of this program unless the file has its own \
                 (`orator_rest_joints`), turned as those of BVH takes."
            }
            MotionKind::Shards => "Samples of other datasets of this form, as they were.",
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

/// Note on files that belong to no motion.
fn passed_over(files: &[PathBuf]) -> Option<String> {
    let names: Vec<String> = files.iter().map(|path| file_name(path)).collect();
    let n = counted(names.len(), "file");
    (!names.is_empty()).then(|| format!("passed over {n} without motion of the same name: {}", first_three(&names)))
}

/// At most two messages per reason why nothing was accepted, and the number of the others.
fn first_reasons(items: &[ImportItem], inspected: &[InspectedItem]) -> String {
    let mut n_by_reason: BTreeMap<String, usize> = BTreeMap::new();
    let lines = items.iter().zip(inspected).map(|(item, inspected)| inspected.line(&item.file()));
    let mut messages: Vec<String> = Vec::new();
    for line in lines {
        let n = n_by_reason.entry(line.reason.clone()).or_default();
        *n += 1;
        if *n <= 2 {
            messages.push(format!("{}: {}", line.file, line.message));
        }
    }
    let n_others = inspected.len() - messages.len();
    let others = if n_others > 0 { format!("; and {}", counted(n_others, "other")) } else { String::new() };
    messages.join("; ") + &others
}

#[derive(Clone, Debug)]
pub struct ImportPlan {
    pub sources: Vec<PathBuf>,
    /// Kind of the sources to import; `None`: every kind.
    pub kind: Option<MotionKind>,
    /// Speaker of the takes of GENEA challenges to import; `None`: every speaker.
    pub speaker_id: Option<u32>,
    /// Description of the dataset; `about.fps` equals `limits.fps`.
    pub about: About,
    pub limits: TakeLimits,
    /// Shares of the splits, seconds of shared sound, size of shards.
    pub dataset: config::DatasetConfig,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ImportOutcome {
    pub file: String,
    /// One of `accepted`, `rejected`, `failed`.
    pub outcome: &'static str,
    pub accepted_secs: f64,
    pub reason: String,
    pub message: String,
}
