//! Dataset without some of its videos: the entries of the others are linked byte for byte into a new folder, references
//! to the forgotten ones are removed from them, the common files are assembled again, and the new folder replaces the
//! old one.

use crate::info::DatasetInfo;
use crate::leakage::Leakage;
use crate::split::SplitBy;
use crate::write::assemble::assemble;
use crate::write::part::{self, VideoEntry};
use crate::{INFO, LEAKAGE};
use crate::{pretty, read_json};
use anyhow::{Context, Result, ensure};
use orator_base::stage::workdir;
use std::collections::BTreeSet;
use std::path::Path;

/// Replacement of a forgotten video's name in the entries of others.
const FORGOTTEN: &str = "a video that was forgotten";

/// Whether the video has samples in the dataset; one whose entry is damaged may have.
pub fn has_samples(dir: &Path, name: &str) -> bool {
    VideoEntry::read(&VideoEntry::path(dir, name)).map_or(true, |part| !part.samples.is_empty())
}

/// Checks that the files of `dir` without the videos `names` match their checksums; assembling damaged files would give
/// them new ones.
///
/// # Errors
/// A file of another video that does not match `checksums.b3`.
pub fn ensure_sound_without(dir: &Path, names: &BTreeSet<String>) -> Result<()> {
    if !dir.join(part::FOLDER).is_dir() {
        return Ok(());
    }
    let stated = part::stated_hashes(dir);
    for name in part::names(dir)?.into_iter().filter(|name| !names.contains(name)) {
        let is_sound = VideoEntry::read(&VideoEntry::path(dir, &name)).is_ok_and(|part| part.is_sound(dir, &stated));
        ensure!(
            is_sound,
            "{name}, which stays, is damaged in the dataset {}: nothing was removed. Make it anew with `orator run` \
             (`orator dataset verify --deep` names its files), or forget it too",
            dir.display()
        );
    }
    Ok(())
}

/// Replaces `dir` by the dataset without the videos `names`; without any video left, `dir` is removed.
///
/// # Errors
/// An entry that cannot be read, a folder that cannot be written.
pub fn without(dir: &Path, names: &BTreeSet<String>) -> Result<()> {
    if !dir.exists() {
        return Ok(());
    }
    let left: Vec<String> = if dir.join(part::FOLDER).is_dir() {
        part::names(dir)?.into_iter().filter(|name| !names.contains(name)).collect()
    } else {
        Vec::new()
    };
    if left.is_empty() {
        return remove_whole(dir).with_context(|| format!("cannot remove {}", dir.display()));
    }
    let attempt = workdir::attempt_folder(dir)?;
    let made = || -> Result<()> {
        let info: DatasetInfo = read_json(&dir.join(INFO))?;
        let leakage: Leakage = read_json(&dir.join(LEAKAGE))?;
        let mut compared = leakage.compared();
        compared.shared.retain(|shared| !names.contains(&shared.a) && !names.contains(&shared.b));
        for name in &left {
            let part = VideoEntry::read(&VideoEntry::path(dir, name))?;
            let silent = silenced(&part, names);
            part.take_over(dir, &attempt)?;
            if silent != part {
                // Written anew, since the old file is linked into the old dataset.
                workdir::write_file(&VideoEntry::path(&attempt, name), &pretty(&silent)?)?;
            }
        }
        assemble(&attempt, &info.about(), &compared)?;
        workdir::replace_folder(&attempt, dir)
    };
    let made = made().with_context(|| format!("cannot make the dataset {} anew", dir.display()));
    if made.is_err() {
        let _ = std::fs::remove_dir_all(&attempt);
    }
    made
}

/// Removes a dataset, the entries of its videos last: by them another forget after a kill knows what is to go.
fn remove_whole(dir: &Path) -> std::io::Result<()> {
    let entries = dir.join(part::FOLDER);
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

/// Entry without the names of the forgotten videos.
fn silenced(part: &VideoEntry, names: &BTreeSet<String>) -> VideoEntry {
    let mut part = part.clone();
    if matches!(&part.split_by, SplitBy::SoundOf(other) if names.contains(other)) {
        // Its split does not change.
        part.split_by = SplitBy::Share;
    }
    for refused in &mut part.ledger.refused {
        names.iter().for_each(|name| refused.message = refused.message.replace(name.as_str(), FORGOTTEN));
    }
    part
}
