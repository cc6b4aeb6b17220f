//! Common files of a dataset, assembled from the entries of its videos: `index.jsonl`, `ledger.jsonl`, `info.json`,
//! `stats.json`, `leakage.json`, `README.md`, and `checksums.b3` with the BLAKE3 of every other file in the form of
//! `b3sum`. The bytes depend on the videos alone, so a dataset grows, forgets and is verified by assembling it again.
//! Memory: one video, and a line for each.

use super::part::{self, EntryWriter, VideoEntry, VideoSource};
use crate::bones::{VideoBones, of_speaker};
use crate::info::{About, DatasetInfo, DatasetVideo, SplitInfo};
use crate::leakage::{Leakage, SoundComparison};
use crate::pretty;
use crate::split::{Split, SplitBy, TimeBlock};
use crate::stats::{DatasetStats, StatsCollector};
use crate::{CHECKSUMS, INDEX, INFO, LEAKAGE, LEDGER, README, STATS, card};
use anyhow::{Context, Result};
use orator_base::stage::ledger::Ledger;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Line of `ledger.jsonl`: the account of every second of a video.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LedgerLine {
    pub name: String,
    pub file: String,
    /// Split; `None`: no sample, or samples in several splits (`blocks`).
    pub split: Option<Split>,
    /// Blocks of time that belong to the splits; empty for a whole video.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub blocks: Vec<TimeBlock>,
    /// Reason why the video has no result.
    pub failure: Option<String>,
    #[serde(flatten)]
    pub ledger: Ledger,
}

/// Opener of an assembled file by name.
pub type Open<'a> = dyn FnMut(&str) -> Result<Box<dyn Write>> + 'a;

/// Assembles the dataset in `dir` in place.
pub fn assemble(dir: &Path, about: &About, compared: &SoundComparison) -> Result<(DatasetInfo, DatasetStats)> {
    assemble_into(dir, about, compared, &mut |name| {
        let path = dir.join(name);
        let file = File::create(&path).with_context(|| format!("writing {}", path.display()))?;
        Ok(Box::new(BufWriter::new(file)))
    })
}

/// Assembles the dataset in `dir` into files that `open` provides.
pub fn assemble_into(
    dir: &Path,
    about: &About,
    compared: &SoundComparison,
    open: &mut Open,
) -> Result<(DatasetInfo, DatasetStats)> {
    let mut checksums = BTreeMap::new();
    let mut index = HashedFile::new(INDEX, open)?;
    let mut ledger = HashedFile::new(LEDGER, open)?;
    let mut splits: BTreeMap<Split, SplitInfo> = Split::ALL.map(|split| (split, SplitInfo::default())).into();
    let (mut videos, mut bones, mut gatherer) = (Vec::new(), Vec::<VideoBones>::new(), StatsCollector::default());
    let mut placed: BTreeMap<String, Vec<TimeBlock>> = BTreeMap::new();
    for name in part::names(dir)? {
        let path = VideoEntry::path(dir, &name);
        let part = VideoEntry::read(&path)?;
        checksums.extend(part.files());
        checksums.insert(format!("{}/{name}.json", part::FOLDER), orator_base::stage::fingerprint::hash_file(&path)?);
        gatherer.push(&part);
        part.samples.iter().try_for_each(|sample| index.line(sample))?;
        let n_frames: usize = part.samples.iter().map(|sample| sample.n_frames).sum();
        if !part.samples.is_empty() {
            bones.push(part.bones.clone());
            placed.insert(name.clone(), part.placed());
        }
        for split in Split::ALL.into_iter().filter(|split| part.samples.iter().any(|sample| sample.split == *split)) {
            let own = part.samples.iter().filter(|sample| sample.split == split);
            let info = splits.entry(split).or_default();
            info.shards.extend(part.shards.iter().filter(|shard| part.split_of(shard) == Some(split)).cloned());
            info.videos.push(name.clone());
            info.samples += own.clone().count();
            info.frames += own.map(|sample| sample.n_frames).sum::<usize>();
            info.secs = about.fps.secs(info.frames);
        }
        videos.push(DatasetVideo {
            name: name.clone(),
            file: part.file.clone(),
            content: part.content,
            split: part.split,
            split_by: part.split_by,
            blocks: part.blocks.clone(),
            samples: part.samples.len(),
            secs: about.fps.secs(n_frames),
        });
        let (file, split, failure, of_video) = (part.file, part.split, part.failure, part.ledger);
        let blocks = part.blocks;
        ledger.line(&LedgerLine { name, file, split, blocks, failure, ledger: of_video })?;
    }
    checksums.insert(INDEX.to_owned(), index.finish()?);
    checksums.insert(LEDGER.to_owned(), ledger.finish()?);
    let leakage = Leakage::new(compared, &placed);
    let stats = gatherer.finish();
    let info = DatasetInfo::new(about, &of_speaker(&bones), splits, videos);
    let info = if stats.footage.words.is_some() { info.with_words() } else { info };
    let info = if stats.posture.is_some() { info.with_posture() } else { info };
    let texts = [
        (INFO, pretty(&info)?),
        (STATS, pretty(&stats)?),
        (LEAKAGE, pretty(&leakage)?),
        (README, card::text(&info, &stats, &leakage).into_bytes()),
    ];
    for (name, bytes) in texts {
        let mut file = HashedFile::new(name, open)?;
        file.write(&bytes)?;
        checksums.insert(name.to_owned(), file.finish()?);
    }
    let mut file = HashedFile::new(CHECKSUMS, open)?;
    for (name, hash) in &checksums {
        file.write(format!("{hash}  {name}\n").as_bytes())?;
    }
    file.finish()?;
    Ok((info, stats))
}

/// File with a running hash.
struct HashedFile {
    name: &'static str,
    to: Box<dyn Write>,
    hasher: blake3::Hasher,
}

impl HashedFile {
    fn new(name: &'static str, open: &mut Open) -> Result<Self> {
        Ok(Self { name, to: open(name)?, hasher: blake3::Hasher::new() })
    }

    fn write(&mut self, bytes: &[u8]) -> Result<()> {
        self.hasher.update(bytes);
        self.to.write_all(bytes).with_context(|| format!("cannot write {} of the dataset", self.name))
    }

    fn line(&mut self, value: &impl Serialize) -> Result<()> {
        let mut bytes = serde_json::to_vec(value)?;
        bytes.push(b'\n');
        self.write(&bytes)
    }

    fn finish(mut self) -> Result<String> {
        self.to.flush().with_context(|| format!("cannot write {} of the dataset", self.name))?;
        Ok(self.hasher.finalize().to_hex().to_string())
    }
}

/// Writer of a dataset. Memory: one sample, and the locations of a video's samples.
pub struct DatasetWriter {
    dir: PathBuf,
    about: About,
    max_shard_bytes: u64,
    compared: SoundComparison,
}

impl DatasetWriter {
    /// Begins a dataset in the existing, empty folder `dir`. A shard is closed before it would exceed
    /// `max_shard_bytes`.
    pub fn new(dir: &Path, about: About, max_shard_bytes: u64) -> Self {
        Self { dir: dir.to_owned(), about, max_shard_bytes, compared: SoundComparison::default() }
    }

    /// Sets the comparison of the videos' sound.
    pub fn with_compared(self, compared: SoundComparison) -> Self {
        Self { compared, ..self }
    }

    /// Begins a video, which `finish` of the result ends. Videos may be written in any order.
    pub fn video(&self, source: VideoSource, split: Split, split_by: SplitBy) -> Result<EntryWriter> {
        EntryWriter::new(&self.dir, source, Some(split), split_by, self.max_shard_bytes)
    }

    /// Begins a video with samples in several splits, cut from `blocks`.
    pub fn video_in_blocks(&self, source: VideoSource, blocks: Vec<TimeBlock>) -> Result<EntryWriter> {
        let writer = EntryWriter::new(&self.dir, source, None, SplitBy::Time, self.max_shard_bytes)?;
        Ok(writer.with_blocks(blocks))
    }

    /// Assembles the dataset from its videos.
    pub fn finish(self) -> Result<(DatasetInfo, DatasetStats)> {
        assemble(&self.dir, &self.about, &self.compared)
    }
}
