//! Entry of a video in a dataset: its shards, its sound codes (`videos/<name>.sound`, u32 little endian), and
//! `videos/<name>.json` with its origin and totals. All other files are assembled from the entries (`assemble`), so a
//! video can be added or forgotten without changing the files of another.

use super::tar::ShardWriter;
use crate::bones::{VideoBones, check_lengths};
use crate::index::{SampleRef, ShardRef};
use crate::joint_stats::JointMoments;
use crate::sample::Sample;
use crate::split::SplitBy;
use crate::{pretty, read_json};
use anyhow::{Context, Result, bail, ensure};
use orator_base::input;
use orator_base::stage::fingerprint::hash_file;
use orator_base::stage::ledger::Ledger;
use orator_base::types::file_name::FileName;
use orator_base::types::split::{Split, TimeBlock};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Folder of the entries in the dataset folder.
pub const FOLDER: &str = "videos";

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VideoEntry {
    pub schema: u32,
    /// Name `<slug of the file's name>-<8 hex of its content>`, the prefix of its samples' keys.
    pub name: FileName,
    pub file: String,
    /// BLAKE3 of the video file; empty if it could not be read.
    pub content: String,
    /// BLAKE3 of everything the shards depend on; shards with an equal hash are reused.
    #[serde(rename = "made_from")]
    pub inputs_hash: String,
    /// Split; `None`: no samples, or samples in several splits (`blocks`).
    pub split: Option<Split>,
    pub split_by: SplitBy,
    /// Time blocks with their splits; empty for a video that is in one split.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub blocks: Vec<TimeBlock>,
    pub ledger: Ledger,
    /// Stage that failed, and its error; `None`: no failure.
    pub failure: Option<String>,
    pub bones: VideoBones,
    /// BLAKE3 of the sound codes; `None`: no sound.
    pub sound: Option<String>,
    pub shards: Vec<ShardRef>,
    pub samples: Vec<SampleRef>,
    /// Silence appended where the sound ended before the motion, seconds.
    pub padded_sound_secs: f64,
    /// Joint statistics of the samples; for a video in several splits, of its training samples.
    pub moments: JointMoments,
    /// Statistics of the head and trunk angles of the same samples; `None`: the samples have no angles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub posture: Option<JointMoments>,
}

/// Properties of a video that are known before its samples are written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VideoSource {
    /// Name; [a-z0-9_-] only.
    pub name: String,
    pub file: String,
    pub content: String,
    pub inputs_hash: String,
    pub ledger: Ledger,
    pub bones: VideoBones,
    pub failure: Option<String>,
}

pub struct EntryWriter {
    dir: PathBuf,
    entry: VideoEntry,
    max_shard_bytes: u64,
    shards: BTreeMap<Split, ShardWriter>,
}

impl EntryWriter {
    /// Starts the entry of a video in the dataset in `dir`. All its samples are in `split`, or (`None`) in several
    /// splits. A shard is closed before it would exceed `max_shard_bytes`.
    pub fn new(
        dir: &Path,
        source: VideoSource,
        split: Option<Split>,
        split_by: SplitBy,
        max_shard_bytes: u64,
    ) -> Result<Self> {
        let VideoSource { name, file, content, inputs_hash, ledger, bones, failure } = source;
        check_name(&name)?;
        ensure!(
            !VideoEntry::path(dir, &name).exists(),
            "duplicate video name {name} in the dataset: rename or exclude the file {file}"
        );
        let entry = VideoEntry {
            schema: crate::SCHEMA,
            name: FileName::new(name)?,
            file,
            content,
            inputs_hash,
            split,
            split_by,
            blocks: Vec::new(),
            ledger,
            failure,
            bones,
            sound: None,
            shards: Vec::new(),
            samples: Vec::new(),
            padded_sound_secs: 0.0,
            moments: JointMoments::default(),
            posture: None,
        };
        Ok(Self { dir: dir.to_owned(), entry, max_shard_bytes, shards: BTreeMap::new() })
    }

    /// Sets the time blocks that the samples are cut from.
    pub fn with_blocks(mut self, blocks: Vec<TimeBlock>) -> Self {
        self.entry.blocks = blocks;
        self
    }

    /// Appends a sample to the shards; `padded_secs` of its sound are appended silence.
    pub fn push(&mut self, sample: &Sample, padded_secs: f64) -> Result<()> {
        self.push_to(self.entry.split.unwrap_or(Split::Train), sample, padded_secs)
    }

    /// Appends a sample to the shards of `split`, for a video in several splits.
    pub fn push_to(&mut self, split: Split, sample: &Sample, padded_secs: f64) -> Result<()> {
        self.entry.padded_sound_secs += padded_secs;
        self.push_members(split, sample, &sample.members()?)
    }

    /// Appends a sample of another dataset with the bytes of its JSON unchanged.
    pub fn push_with_json(&mut self, split: Split, sample: &Sample, json: Vec<u8>) -> Result<()> {
        let mut members = sample.members()?;
        members[0] = json;
        self.push_members(split, sample, &members)
    }

    fn push_members(&mut self, split: Split, sample: &Sample, members: &[Vec<u8>; 5]) -> Result<()> {
        let name = &self.entry.name;
        ensure!(
            sample.key.starts_with(&**name),
            "the key {} does not start with the name of its video, {name}",
            sample.key
        );
        let (dir, max_bytes) = (&self.dir, self.max_shard_bytes);
        let shards = self.shards.entry(split).or_insert_with(|| ShardWriter::new(dir, name, split, max_bytes));
        shards.push_members(sample, members)?;
        let is_counted = self.entry.split.is_some() || split == Split::Train;
        if is_counted {
            self.entry.moments.add_motion(&sample.motion);
        }
        if let Some(posture) = &sample.posture {
            let moments = self.entry.posture.get_or_insert_with(JointMoments::of_posture);
            if is_counted {
                moments.add_posture(posture);
            }
        }
        Ok(())
    }

    /// Closes the shards and writes the video's JSON. `sound` is the result of `write_sound`, if the video has sound. A
    /// video without samples gets no split.
    pub fn finish(mut self, sound: Option<String>) -> Result<VideoEntry> {
        for shards in std::mem::take(&mut self.shards).into_values() {
            let (shards, samples) = shards.finish()?;
            self.entry.shards.extend(shards);
            self.entry.samples.extend(samples);
        }
        self.entry.split = self.entry.split.filter(|_| !self.entry.samples.is_empty());
        let folder = self.dir.join(FOLDER);
        fs::create_dir_all(&folder).with_context(|| format!("cannot create the folder {}", folder.display()))?;
        self.entry.sound = sound;
        self.entry.write(&self.dir)?;
        Ok(self.entry)
    }
}

impl VideoEntry {
    /// Path of `videos/<name>.json` in the dataset in `dir`.
    pub fn path(dir: &Path, name: &str) -> PathBuf {
        dir.join(FOLDER).join(format!("{name}.json"))
    }

    /// Reads an entry.
    ///
    /// # Errors
    /// An unreadable file, another layout version, another video's name or shards, values out of range.
    pub fn read(path: &Path) -> Result<Self> {
        let entry: Self = read_json(path)?;
        ensure!(
            entry.schema == crate::SCHEMA,
            "{} has layout version {}, expected {}",
            path.display(),
            entry.schema,
            crate::SCHEMA
        );
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        ensure!(entry.name == *stem, "{} describes another video, {:?}", path.display(), entry.name);
        let is_of_video = |shard: &&ShardRef| {
            let rest = Split::ALL.iter().find_map(|split| shard.file.strip_prefix(split.name())?.strip_prefix('-'));
            rest.is_some_and(|rest| rest.starts_with(&*entry.name) && rest.strip_suffix(".tar").is_some())
        };
        if !entry.bones.lengths_metres.is_empty() {
            check_lengths("bones.lengths_metres", &entry.bones.lengths_metres)
                .with_context(|| path.display().to_string())?;
        }
        let silence = entry.padded_sound_secs;
        ensure!(silence >= 0.0, "{}: `padded_sound_secs` is {silence}, expected 0 or more", path.display());
        if let Some(other) = entry.shards.iter().find(|shard| !is_of_video(shard)) {
            bail!("{} lists the shard {}, which belongs to another video", path.display(), other.file);
        }
        Ok(entry)
    }

    fn write(&self, dir: &Path) -> Result<()> {
        let path = Self::path(dir, &self.name);
        fs::write(&path, pretty(self)?).with_context(|| format!("cannot write {}", path.display()))
    }

    /// Reads the sound codes from the dataset in `dir`; empty without sound.
    pub fn codes(&self, dir: &Path) -> Result<Vec<u32>> {
        if self.sound.is_none() { Ok(Vec::new()) } else { read_sound(dir, &self.name) }
    }

    /// Split of the samples in a shard; `None`: none of this video's samples are in it.
    pub fn split_of(&self, shard: &ShardRef) -> Option<Split> {
        self.samples.iter().find(|sample| sample.shard == shard.file).map(|sample| sample.split)
    }

    /// Time blocks with their splits; for a video in one split, a single unbounded block.
    pub fn blocks_with_splits(&self) -> Vec<TimeBlock> {
        match self.split {
            Some(split) => vec![TimeBlock::entire(split)],
            None => self.blocks.clone(),
        }
    }

    /// Paths in the dataset folder and BLAKE3 hashes of all files of the video except its JSON.
    pub fn files(&self) -> Vec<(String, String)> {
        let shards = self.shards.iter().map(|shard| (shard.file.to_string(), shard.blake3.clone()));
        let sound = self.sound.iter().map(|hash| (format!("{FOLDER}/{}.sound", self.name), hash.clone()));
        shards.chain(sound).collect()
    }

    /// Links this video's files from the dataset `from` into `to`, or copies them where links fail; existing ones stay.
    pub fn link_into(&self, from: &Path, to: &Path) -> Result<()> {
        fs::create_dir_all(to.join(FOLDER)).with_context(|| format!("cannot create {}", to.join(FOLDER).display()))?;
        let json = format!("{FOLDER}/{}.json", self.name);
        for file in self.files().into_iter().map(|(file, _)| file).chain([json]) {
            let (old, new) = (from.join(&file), to.join(&file));
            if new.exists() {
                continue;
            }
            fs::hard_link(&old, &new)
                .or_else(|_| fs::copy(&old, &new).map(|_| ()))
                .with_context(|| format!("cannot link or copy {}", old.display()))?;
        }
        Ok(())
    }

    /// Whether all files of the video in the dataset in `dir` match `stated` (hashes by path, as in `checksums.b3`).
    pub fn is_intact(&self, dir: &Path, stated: &BTreeMap<String, String>) -> bool {
        let json = format!("{FOLDER}/{}.json", self.name);
        let as_stated =
            |file: &str| stated.get(file).is_some_and(|hash| hash_file(&dir.join(file)).is_ok_and(|now| now == *hash));
        as_stated(&json) && self.files().iter().all(|(file, hash)| stated.get(file) == Some(hash) && as_stated(file))
    }
}

/// Hashes by path from `checksums.b3` of the dataset in `dir`; empty where it cannot be read.
pub fn stated_hashes(dir: &Path) -> BTreeMap<String, String> {
    let text = input::read_text(dir.join(crate::CHECKSUMS), input::MAX_TEXT).unwrap_or_default();
    text.lines().filter_map(|line| line.split_once("  ")).map(|(hash, file)| (file.into(), hash.into())).collect()
}

/// Checks the name of a video: 1 to 64 characters of [a-z0-9_-].
pub fn check_name(name: &str) -> Result<()> {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' || c == '_';
    ensure!(
        !name.is_empty() && name.len() <= 64 && name.chars().all(plain),
        "invalid video name {name:?}: expected 1 to 64 of a-z, 0-9, - and _"
    );
    Ok(())
}

/// Names of the videos of the dataset in `dir`, sorted.
pub fn names(dir: &Path) -> Result<Vec<String>> {
    let folder = dir.join(FOLDER);
    let entries = fs::read_dir(&folder).with_context(|| format!("cannot list the folder {}", folder.display()))?;
    let mut names = Vec::new();
    for entry in entries {
        let file = entry.with_context(|| format!("cannot list the folder {}", folder.display()))?.file_name();
        names.extend(file.to_string_lossy().strip_suffix(".json").map(str::to_owned));
    }
    names.sort();
    Ok(names)
}

/// Writes the sound codes of the video `name` into the dataset in `dir`; returns their hash.
pub fn write_sound(dir: &Path, name: &str, codes: &[u32]) -> Result<String> {
    let bytes: Vec<u8> = codes.iter().flat_map(|code| code.to_le_bytes()).collect();
    let path = sound_path(dir, name);
    let written = fs::create_dir_all(dir.join(FOLDER)).and_then(|()| fs::write(&path, &bytes));
    written.with_context(|| format!("cannot write {}", path.display()))?;
    Ok(blake3::hash(&bytes).to_hex().to_string())
}

/// Reads the sound codes of the video `name`.
pub fn read_sound(dir: &Path, name: &str) -> Result<Vec<u32>> {
    let path = sound_path(dir, name);
    let bytes = input::read(&path, input::MAX_TEXT).with_context(|| format!("cannot read {}", path.display()))?;
    ensure!(bytes.len().is_multiple_of(4), "{} is truncated: run the dataset stage again with --force", path.display());
    Ok(bytes.as_chunks::<4>().0.iter().map(|code| u32::from_le_bytes(*code)).collect())
}

/// Removes the sound codes of a video that is excluded.
pub fn remove_sound(dir: &Path, name: &str) -> Result<()> {
    let path = sound_path(dir, name);
    fs::remove_file(&path).with_context(|| format!("cannot remove {}", path.display()))
}

fn sound_path(dir: &Path, name: &str) -> PathBuf {
    dir.join(FOLDER).join(format!("{name}.sound"))
}
