//! A dataset without some of its videos: the parts of the others are taken over byte for byte into a new folder, what is
//! said of the forgotten ones in them is taken out, the rest is put together again, and the new folder takes the old
//! one's place.

use crate::dataset::info::DatasetInfo;
use crate::dataset::leakage::Leakage;
use crate::dataset::split::SplitBy;
use crate::dataset::write::assemble::assemble;
use crate::dataset::write::part;
use crate::dataset::write::part::VideoEntry;
use crate::dataset::{INFO, LEAKAGE};
use crate::stage::workdir;
use anyhow::{Context, Result, ensure};
use std::collections::BTreeSet;
use std::path::Path;

/// What stands for a forgotten video's name in the accounts of others.
const FORGOTTEN: &str = "a video that was forgotten";

/// Whether the video of this name has samples in the dataset; one whose file is damaged may have.
pub fn has_samples(dir: &Path, name: &str) -> bool {
    VideoEntry::read(&VideoEntry::path(dir, name)).map_or(true, |part| !part.samples.is_empty())
}

/// Whether what stays of `dir` without the videos `names` is as it was written: putting it together again would give
/// damage a checksum of its own.
///
/// # Errors
/// A file of another video that is not what `checksums.b3` says.
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

/// Puts a dataset without the videos `names` in the place of `dir`; without any video left, `dir` goes.
///
/// # Errors
/// A part that cannot be read, a folder that cannot be written.
pub fn without(dir: &Path, names: &BTreeSet<String>) -> Result<()> {
    if !dir.exists() {
        return Ok(());
    }
    let left: Vec<String> = match dir.join(part::FOLDER).is_dir() {
        true => part::names(dir)?.into_iter().filter(|name| !names.contains(name)).collect(),
        false => Vec::new(),
    };
    if left.is_empty() {
        return std::fs::remove_dir_all(dir).with_context(|| format!("cannot remove {}", dir.display()));
    }
    let attempt = workdir::attempt_folder(dir)?;
    let made = || -> Result<()> {
        let info: DatasetInfo = read_json(dir, INFO)?;
        let leakage: Leakage = read_json(dir, LEAKAGE)?;
        let mut compared = leakage.compared();
        compared.shared.retain(|shared| !names.contains(&shared.a) && !names.contains(&shared.b));
        for name in &left {
            let part = VideoEntry::read(&VideoEntry::path(dir, name))?;
            let silent = silenced(&part, names);
            part.take_over(dir, &attempt)?;
            if silent != part {
                // a new file: the old one is linked into the old dataset
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

/// The part without the names of the forgotten.
fn silenced(part: &VideoEntry, names: &BTreeSet<String>) -> VideoEntry {
    let mut part = part.clone();
    if matches!(&part.split_by, SplitBy::SoundOf(other) if names.contains(other)) {
        // it stays where it is
        part.split_by = SplitBy::Name;
    }
    for refused in &mut part.ledger.refused {
        names.iter().for_each(|name| refused.says = refused.says.replace(name.as_str(), FORGOTTEN));
    }
    part
}

fn pretty(part: &VideoEntry) -> Result<Vec<u8>> {
    let mut bytes = serde_json::to_vec_pretty(part)?;
    bytes.push(b'\n');
    Ok(bytes)
}

fn read_json<T: serde::de::DeserializeOwned>(dir: &Path, name: &str) -> Result<T> {
    let path = dir.join(name);
    let bytes = std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_slice(&bytes).with_context(|| format!("{} is damaged", path.display()))
}
