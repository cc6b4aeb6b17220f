//! Entry of a video in a dataset: its shards, its sound codes (`videos/<name>.sound`, u32 little endian), and
//! `videos/<name>.json` with origin and totals. All other files are assembled from the entries (`assemble`), so that a
//! video is added or forgotten without touching another.

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

/// Folder of the entries within the dataset.
pub const FOLDER: &str = "videos";

/// Video of a dataset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VideoEntry {
    pub schema: u32,
    /// Name `<slug of the file's name>-<8 hex of its content>`, the prefix of its samples' keys.
    pub name: FileName,
    /// File name of the video.
    pub file: String,
    /// BLAKE3 of the video file; empty: unreadable.
    pub content: String,
    /// BLAKE3 of all inputs of its shards; shards of equal inputs are reused.
    pub made_from: String,
    /// Split; `None`: no sample, or samples in several splits (`blocks`).
    pub split: Option<Split>,
    /// Reason of the split.
    pub split_by: SplitBy,
    /// Blocks of time that belong to the splits; empty for a whole video.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub blocks: Vec<TimeBlock>,
    pub ledger: Ledger,
    /// Reason without result: the stage and its error.
    pub failure: Option<String>,
    /// Bone lengths of the samples.
    pub bones: VideoBones,
    /// BLAKE3 of the sound codes; `None`: no sound.
    pub sound: Option<String>,
    pub shards: Vec<ShardRef>,
    pub samples: Vec<SampleRef>,
    /// Silence appended where the sound ended before the motion, seconds.
    pub padded_sound_secs: f64,
    /// Moments of the samples; of a video in several splits, those of its training samples.
    pub moments: JointMoments,
    /// Moments of head and trunk of the same samples; `None`: they have no angles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub posture: Option<JointMoments>,
}

/// Properties of a video known before its samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VideoSource {
    /// Name; [a-z0-9_-] only.
    pub name: String,
    pub file: String,
    pub content: String,
    pub made_from: String,
    pub ledger: Ledger,
    pub bones: VideoBones,
    pub failure: Option<String>,
}

/// Writer of one video.
pub struct EntryWriter {
    dir: PathBuf,
    part: VideoEntry,
    max_shard_bytes: u64,
    /// Shards of each split.
    shards: BTreeMap<Split, ShardWriter>,
}

impl EntryWriter {
    /// Begins a video of the dataset in `dir`: in `split` as a whole, or (`None`) with samples in several. A shard is
    /// closed before it would exceed `max_shard_bytes`.
    pub fn new(
        dir: &Path,
        source: VideoSource,
        split: Option<Split>,
        split_by: SplitBy,
        max_shard_bytes: u64,
    ) -> Result<Self> {
        let VideoSource { name, file, content, made_from, ledger, bones, failure } = source;
        check_name(&name)?;
        ensure!(
            !VideoEntry::path(dir, &name).exists(),
            "two videos would be called {name} in the dataset; rename the file {file} or leave it out"
        );
        let part = VideoEntry {
            schema: crate::SCHEMA,
            name: FileName::new(name)?,
            file,
            content,
            made_from,
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
        Ok(Self { dir: dir.to_owned(), part, max_shard_bytes, shards: BTreeMap::new() })
    }

    /// Names the blocks of time that the samples are cut from.
    pub fn with_blocks(mut self, blocks: Vec<TimeBlock>) -> Self {
        self.part.blocks = blocks;
        self
    }

    /// Adds an interval; shards keep the order of the calls. `padded_secs` of its sound are appended silence.
    pub fn push(&mut self, sample: &Sample, padded_secs: f64) -> Result<()> {
        self.push_to(self.part.split.unwrap_or(Split::Train), sample, padded_secs)
    }

    /// Adds an interval to a split, where the video is in several.
    pub fn push_to(&mut self, split: Split, sample: &Sample, padded_secs: f64) -> Result<()> {
        self.part.padded_sound_secs += padded_secs;
        self.push_members(split, sample, &sample.members()?)
    }

    /// Adds an interval of another dataset with its JSON unchanged.
    pub fn push_as_it_was(&mut self, split: Split, sample: &Sample, json: Vec<u8>) -> Result<()> {
        let mut members = sample.members()?;
        members[0] = json;
        self.push_members(split, sample, &members)
    }

    fn push_members(&mut self, split: Split, sample: &Sample, members: &[Vec<u8>; 5]) -> Result<()> {
        let name = &self.part.name;
        ensure!(sample.key.starts_with(&**name), "the key {} does not begin with its video's name {name}", sample.key);
        let (dir, max_bytes) = (&self.dir, self.max_shard_bytes);
        let shards = self.shards.entry(split).or_insert_with(|| ShardWriter::new(dir, name, split, max_bytes));
        shards.push_members(sample, members)?;
        let counts = self.part.split.is_some() || split == Split::Train;
        if counts {
            self.part.moments.learn(&sample.motion);
        }
        if let Some(posture) = &sample.posture {
            let moments = self.part.posture.get_or_insert_with(JointMoments::of_posture);
            if counts {
                moments.learn_posture(posture);
            }
        }
        Ok(())
    }

    /// Closes the shards and writes the video's JSON; `sound` is the result of `write_sound`, if it has sound. A video
    /// without a sample has no split.
    pub fn finish(mut self, sound: Option<String>) -> Result<VideoEntry> {
        for shards in std::mem::take(&mut self.shards).into_values() {
            let (shards, samples) = shards.finish()?;
            self.part.shards.extend(shards);
            self.part.samples.extend(samples);
        }
        self.part.split = self.part.split.filter(|_| !self.part.samples.is_empty());
        let folder = self.dir.join(FOLDER);
        fs::create_dir_all(&folder).with_context(|| format!("making the folder {}", folder.display()))?;
        self.part.sound = sound;
        self.part.write(&self.dir)?;
        Ok(self.part)
    }
}

impl VideoEntry {
    /// Path of `videos/<name>.json` in the dataset in `dir`.
    pub fn path(dir: &Path, name: &str) -> PathBuf {
        dir.join(FOLDER).join(format!("{name}.json"))
    }

    /// Reads an entry; its ledger must be complete and its layout current.
    pub fn read(path: &Path) -> Result<Self> {
        let part: Self = read_json(path)?;
        ensure!(part.schema == crate::SCHEMA, "{} has layout version {}", path.display(), part.schema);
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        ensure!(part.name == *stem, "{} speaks of the video {:?}", path.display(), part.name);
        let is_own = |shard: &&ShardRef| {
            let rest = Split::ALL.iter().find_map(|split| shard.file.strip_prefix(split.name())?.strip_prefix('-'));
            rest.is_some_and(|rest| rest.starts_with(&*part.name) && rest.strip_suffix(".tar").is_some())
        };
        if !part.bones.lengths_metres.is_empty() {
            check_lengths("bones.lengths_metres", &part.bones.lengths_metres)
                .with_context(|| path.display().to_string())?;
        }
        let silence = part.padded_sound_secs;
        ensure!(silence >= 0.0, "{}: `padded_sound_secs` is {silence}, expected 0 or more", path.display());
        if let Some(other) = part.shards.iter().find(|shard| !is_own(shard)) {
            bail!("{} names the shard {}, which is none of its video's", path.display(), other.file);
        }
        Ok(part)
    }

    fn write(&self, dir: &Path) -> Result<()> {
        let path = Self::path(dir, &self.name);
        fs::write(&path, pretty(self)?).with_context(|| format!("writing {}", path.display()))
    }

    /// Sound codes from the dataset in `dir`; empty without sound.
    pub fn codes(&self, dir: &Path) -> Result<Vec<u32>> {
        if self.sound.is_none() { Ok(Vec::new()) } else { read_sound(dir, &self.name) }
    }

    /// Split of one of its shards, that of its samples.
    pub fn split_of(&self, shard: &ShardRef) -> Option<Split> {
        self.samples.iter().find(|sample| sample.shard == shard.file).map(|sample| sample.split)
    }

    /// Stretches of it that belong to a split; a whole video has one that it does not outlast.
    pub fn placed(&self) -> Vec<TimeBlock> {
        match self.split {
            Some(split) => vec![TimeBlock::whole(split)],
            None => self.blocks.clone(),
        }
    }

    /// Files by path in the dataset's folder, without the JSON, with their hashes.
    pub fn files(&self) -> Vec<(String, String)> {
        let shards = self.shards.iter().map(|shard| (shard.file.to_string(), shard.blake3.clone()));
        let sound = self.sound.iter().map(|hash| (format!("{FOLDER}/{}.sound", self.name), hash.clone()));
        shards.chain(sound).collect()
    }

    /// Copies this video's files from the dataset in `from` into that in `to`, by hard links where possible.
    pub fn take_over(&self, from: &Path, to: &Path) -> Result<()> {
        fs::create_dir_all(to.join(FOLDER)).with_context(|| format!("making {}", to.join(FOLDER).display()))?;
        let json = format!("{FOLDER}/{}.json", self.name);
        for file in self.files().into_iter().map(|(file, _)| file).chain([json]) {
            let (old, new) = (from.join(&file), to.join(&file));
            if new.exists() {
                continue;
            }
            fs::hard_link(&old, &new)
                .or_else(|_| fs::copy(&old, &new).map(|_| ()))
                .with_context(|| format!("taking over {}", old.display()))?;
        }
        Ok(())
    }

    /// Whether all its files in the dataset in `dir` match `stated` (hashes by path, as in `checksums.b3`).
    pub fn is_sound(&self, dir: &Path, stated: &BTreeMap<String, String>) -> bool {
        let json = format!("{FOLDER}/{}.json", self.name);
        let as_stated =
            |file: &str| stated.get(file).is_some_and(|hash| hash_file(&dir.join(file)).is_ok_and(|now| now == *hash));
        as_stated(&json) && self.files().iter().all(|(file, hash)| stated.get(file) == Some(hash) && as_stated(file))
    }
}

/// Hashes by path from `checksums.b3` of the dataset in `dir`; empty where it cannot be read.
pub fn stated_hashes(dir: &Path) -> BTreeMap<String, String> {
    let text = input::read_text(dir.join(crate::CHECKSUMS), input::MOST_TEXT).unwrap_or_default();
    text.lines().filter_map(|line| line.split_once("  ")).map(|(hash, file)| (file.into(), hash.into())).collect()
}

/// Checks the name of a video.
pub fn check_name(name: &str) -> Result<()> {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' || c == '_';
    ensure!(
        !name.is_empty() && name.len() <= 64 && name.chars().all(plain),
        "{name:?} is no name of a video in a dataset: expected 1 to 64 of a-z, 0-9, - and _"
    );
    Ok(())
}

/// Names of the videos of the dataset in `dir`, sorted.
pub fn names(dir: &Path) -> Result<Vec<String>> {
    let folder = dir.join(FOLDER);
    let entries = fs::read_dir(&folder).with_context(|| format!("reading the folder {}", folder.display()))?;
    let mut names = Vec::new();
    for entry in entries {
        let file = entry.with_context(|| format!("reading the folder {}", folder.display()))?.file_name();
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
    written.with_context(|| format!("writing {}", path.display()))?;
    Ok(blake3::hash(&bytes).to_hex().to_string())
}

/// Reads the sound codes of the video `name`.
pub fn read_sound(dir: &Path, name: &str) -> Result<Vec<u32>> {
    let path = sound_path(dir, name);
    let bytes = input::read(&path, input::MOST_TEXT).with_context(|| format!("reading {}", path.display()))?;
    ensure!(bytes.len().is_multiple_of(4), "{} is cut off: run the dataset stage again with --force", path.display());
    Ok(bytes.as_chunks::<4>().0.iter().map(|code| u32::from_le_bytes(*code)).collect())
}

/// Removes the sound codes of a video that is left out.
pub fn remove_sound(dir: &Path, name: &str) -> Result<()> {
    let path = sound_path(dir, name);
    fs::remove_file(&path).with_context(|| format!("removing {}", path.display()))
}

fn sound_path(dir: &Path, name: &str) -> PathBuf {
    dir.join(FOLDER).join(format!("{name}.sound"))
}
