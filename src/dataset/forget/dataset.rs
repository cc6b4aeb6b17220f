//! Removal of videos from a dataset: the files of the remaining videos are hard-linked into a new folder, references to
//! the forgotten are removed from their entries, the common files are rebuilt, and the new folder replaces the old.

use crate::info::DatasetInfo;
use crate::leakage::Leakage;
use crate::split::SplitBy;
use crate::write::assemble::assemble;
use crate::write::entry::{self, VideoEntry};
use crate::{INFO, LEAKAGE};
use crate::{pretty, read_json};
use anyhow::{Context, Result, ensure};
use orator_base::stage::workdir;
use std::collections::BTreeSet;
use std::path::Path;

/// Replacement for the name of a forgotten video in the entries of other videos.
const FORGOTTEN: &str = "a video that was forgotten";

/// Whether the video has samples in the dataset; true if its entry cannot be read, since it may have some.
pub fn has_samples(dir: &Path, name: &str) -> bool {
    VideoEntry::read(&VideoEntry::path(dir, name)).map_or(true, |entry| !entry.samples.is_empty())
}

/// Checks that the files of all videos except `names` match `checksums.b3`: assembling the dataset again would give
/// damaged files new, matching checksums.
///
/// # Errors
/// A file of a remaining video that does not match its checksum.
pub fn ensure_intact_without(dir: &Path, names: &BTreeSet<String>) -> Result<()> {
    if !dir.join(entry::FOLDER).is_dir() {
        return Ok(());
    }
    let stated = entry::stated_hashes(dir);
    for name in entry::names(dir)?.into_iter().filter(|name| !names.contains(name)) {
        let is_intact =
            VideoEntry::read(&VideoEntry::path(dir, &name)).is_ok_and(|entry| entry.is_intact(dir, &stated));
        ensure!(
            is_intact,
            "nothing was removed: the remaining video {name} is damaged in the dataset {}. Rebuild it with \
             `orator run`, or forget it too (`orator dataset verify --deep` lists the damaged files)",
            dir.display()
        );
    }
    Ok(())
}

/// Replaces the dataset in `dir` by one without the videos `names`; if no video remains, `dir` is removed.
pub fn without(dir: &Path, names: &BTreeSet<String>) -> Result<()> {
    if !dir.exists() {
        return Ok(());
    }
    let remaining: Vec<String> = if dir.join(entry::FOLDER).is_dir() {
        entry::names(dir)?.into_iter().filter(|name| !names.contains(name)).collect()
    } else {
        Vec::new()
    };
    if remaining.is_empty() {
        return remove_dataset(dir).with_context(|| format!("cannot remove {}", dir.display()));
    }
    let attempt = workdir::attempt_folder(dir)?;
    let rebuild = || -> Result<()> {
        let info: DatasetInfo = read_json(&dir.join(INFO))?;
        let leakage: Leakage = read_json(&dir.join(LEAKAGE))?;
        let mut compared = leakage.compared();
        compared.shared.retain(|shared| !names.contains(&shared.a) && !names.contains(&shared.b));
        for name in &remaining {
            let entry = VideoEntry::read(&VideoEntry::path(dir, name))?;
            let redacted_entry = redacted(&entry, names);
            entry.link_into(dir, &attempt)?;
            if redacted_entry != entry {
                // A new file, since writing through the hard link would change the old dataset.
                workdir::write_file(&VideoEntry::path(&attempt, name), &pretty(&redacted_entry)?)?;
            }
        }
        assemble(&attempt, &info.about(), &compared)?;
        workdir::replace_folder(&attempt, dir)
    };
    let result = rebuild().with_context(|| format!("cannot rebuild the dataset {}", dir.display()));
    if result.is_err() {
        let _ = std::fs::remove_dir_all(&attempt);
    }
    result
}

/// Removes a dataset, the entries of its videos last: after a kill, a second `forget` reads there what is left.
fn remove_dataset(dir: &Path) -> std::io::Result<()> {
    let entries = dir.join(entry::FOLDER);
    for folder in [dir, &entries].into_iter().filter(|folder| folder.is_dir()) {
        for entry in std::fs::read_dir(folder)? {
            let path = entry?.path();
            let is_entry = folder == entries && path.extension().is_some_and(|ending| ending == "json");
            if !is_entry && path != entries {
                workdir::remove(&path)?;
            }
        }
    }
    std::fs::remove_dir_all(dir)
}

/// Copy of the entry without the names of the forgotten videos.
fn redacted(entry: &VideoEntry, names: &BTreeSet<String>) -> VideoEntry {
    let mut entry = entry.clone();
    if matches!(&entry.split_by, SplitBy::SoundOf(other) if names.contains(other)) {
        // The video stays in its split; only the reason changes.
        entry.split_by = SplitBy::Share;
    }
    for rejected in &mut entry.ledger.rejected {
        names.iter().for_each(|name| rejected.message = rejected.message.replace(name.as_str(), FORGOTTEN));
    }
    entry
}
