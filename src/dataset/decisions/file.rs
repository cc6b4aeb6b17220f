//! `decisions.toml`, a list of `[[decision]]` tables beside the configuration. It is replaced as a whole under a lock,
//! so that two programs cannot lose a decision; comments in it are not retained.

use super::decision::{Decision, DecisionAction};
use crate::config::Config;
use crate::config::videos::Videos;
use anyhow::{Context, Result, ensure};
use orator_base::input;
use orator_base::stage::workdir::{self, FolderLock};
use std::collections::{BTreeMap, BTreeSet};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

/// Name of the file.
pub const FILE_NAME: &str = "decisions.toml";
/// Largest file, bytes: more than ten thousand decisions.
const MAX_BYTES: u64 = 4 << 20;
const HEADING: &str = "# Decisions by hand, applied by `orator run`. To undo one, remove its table.\n\n";

/// Serialises changes within this program; those of other programs are excluded by a lock of the file.
static CHANGES: Mutex<()> = Mutex::new(());

/// Path of the decisions that belong to the configuration file `config`.
pub fn path(config: &Path) -> PathBuf {
    config.with_file_name(FILE_NAME)
}

/// Reads the decisions beside the configuration file `config`, in the order of the file; none if there is no file.
///
/// # Errors
/// A file that cannot be read or exceeds 4 MiB; an invalid entry. The message names the file, the entry and what was
/// expected.
pub fn read(config: &Path) -> Result<Vec<Decision>> {
    let file = path(config);
    let text = match input::read_text(&file, MAX_BYTES) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
        text => text.with_context(|| format!("cannot read {}", file.display()))?,
    };
    parse(&text).with_context(|| format!("invalid {}: correct or remove it", file.display()))
}

fn parse(text: &str) -> Result<Vec<Decision>> {
    let mut table: BTreeMap<String, Vec<toml::Value>> = toml::from_str(text).context("expected [[decision]] tables")?;
    let entries = table.remove("decision").unwrap_or_default();
    ensure!(table.is_empty(), "unknown keys {:?}: expected [[decision]] tables", table.keys());
    let mut ids = BTreeSet::new();
    let mut decisions = Vec::with_capacity(entries.len());
    for (entry, nth) in entries.into_iter().zip(1..) {
        let id = entry.get("id").and_then(toml::Value::as_str).unwrap_or_default().to_owned();
        let parsed = entry.try_into().context("expected the keys of a decision");
        let decision = parsed.and_then(|decision: Decision| decision.check().map(|()| decision));
        let decision = decision.with_context(|| format!("decision {nth} ({id})"))?;
        ensure!(
            !id.is_empty() && ids.insert(id.clone()),
            "decision {nth} ({id}): expected an `id` that no other decision has"
        );
        decisions.push(decision);
    }
    Ok(decisions)
}

/// Appends a decision to the file beside `config`, and returns it with `id` and `time`, which are assigned.
///
/// # Errors
/// An invalid decision; an invalid file; `BusyFolder` if another program is changing it; it would exceed 4 MiB.
pub fn add(config: &Path, decision: &Decision) -> Result<Decision> {
    decision.check()?;
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    change(config, |decisions| {
        let id = |salt: usize| {
            let text = format!("{decision:?} {} {salt}", now.as_nanos());
            blake3::hash(text.as_bytes()).to_hex().as_str().chars().take(8).collect::<String>()
        };
        let is_free = |id: &String| decisions.iter().all(|known| known.id != *id);
        let id = (0..=decisions.len()).map(id).find(is_free).context("no unused id was found; try again")?;
        let added = Decision { id, time: time_text(now.as_secs()), ..decision.clone() };
        decisions.push(added.clone());
        Ok(added)
    })
}

/// Removes the decision `id` from the file beside `config`, and returns it. The file is removed with its last decision.
///
/// # Errors
/// No decision has this id; an invalid file; `BusyFolder` if another program is changing it.
pub fn remove(config: &Path, id: &str) -> Result<Decision> {
    change(config, |decisions| {
        let at = decisions.iter().position(|known| known.id == id);
        Ok(decisions.remove(at.with_context(|| format!("no decision `{id}` in {}", path(config).display()))?))
    })
}

fn change(config: &Path, work: impl FnOnce(&mut Vec<Decision>) -> Result<Decision>) -> Result<Decision> {
    let file = path(config);
    let _changes = CHANGES.lock().unwrap_or_else(PoisonError::into_inner);
    let _lock = FolderLock::exclusive(&file)?;
    let mut decisions = read(config)?;
    let changed = work(&mut decisions)?;
    if decisions.is_empty() {
        workdir::remove_file(&file)?;
        return Ok(changed);
    }
    let text = HEADING.to_owned() + &toml::to_string(&BTreeMap::from([("decision", &decisions)]))?;
    ensure!(text.len() as u64 <= MAX_BYTES, "{} would exceed {} MiB", file.display(), MAX_BYTES >> 20);
    workdir::write_file(&file, text.as_bytes())?;
    Ok(changed)
}

/// Adds the decisions beside `config` to its videos, `all`. Those without effect are listed in `missing`: no such
/// speaker or video, a word of a speaker without transcripts, or a choice among the persons of a keypoint file.
///
/// # Errors
/// Those of `read`.
pub fn attach(config: &Config, all: &mut [Videos]) -> Result<()> {
    for decision in read(&config.file)? {
        let Decision { id, speaker, video, .. } = &decision;
        let mut configured = config.settings.speaker.iter().filter(|configured| configured.name == *speaker);
        let has_words = configured.any(|configured| !configured.transcripts.is_empty());
        let at = all.iter().position(|videos| videos.speaker == *speaker);
        let problem = match at.map(|at| &all[at]) {
            None => Some(format!("no speaker has the name {speaker}")),
            Some(videos) if videos.units.iter().all(|unit| unit.video != *video) => {
                Some(format!("no video of {speaker} has the name {video}"))
            }
            Some(_) if decision.action == DecisionAction::Word && !has_words => {
                Some(format!("{speaker} has no `transcripts`"))
            }
            Some(videos) if decision.action == DecisionAction::Speaker && videos.keypoints.contains_key(video) => {
                Some(format!("{video} consists of keypoints of one person"))
            }
            Some(_) => None,
        };
        let Some(videos) = all.get_mut(at.unwrap_or(0)) else { return Ok(()) };
        match problem {
            Some(problem) => {
                videos.missing.push(format!("{FILE_NAME}, decision {id}: {problem}: correct or remove the entry"));
            }
            None => videos.decisions.push(decision),
        }
    }
    Ok(())
}

/// Formats seconds since 1970 as RFC 3339 in UTC (Gregorian calendar; days from Howard Hinnant's `civil_from_days`).
pub fn time_text(secs: u64) -> String {
    let (days, of_day) = (secs / 86_400 + 719_468, secs % 86_400);
    let (era, of_era) = (days / 146_097, days % 146_097);
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    // Months are counted from March, so that the leap day is the last one of a year.
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let (month, is_next) = if month < 10 { (month + 3, 0) } else { (month - 9, 1) };
    let (year, [hour, minute, second]) = (400 * era + year + is_next, [of_day / 3600, of_day / 60 % 60, of_day % 60]);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}
