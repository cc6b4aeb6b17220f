//! Assembly of a dataset's common files from the entries of its videos: `index.jsonl`, `ledger.jsonl`, `info.json`,
//! `stats.json`, `leakage.json`, `README.md`, and `checksums.b3` with the BLAKE3 of every other file in the format of
//! `b3sum`. The bytes depend only on the videos, the description and the comparison of their sound, so assembling again
//! is how videos are added or forgotten and how a dataset is verified. Memory: one entry, and a summary of each video.

use super::entry::{self, EntryWriter, VideoEntry, VideoSource};
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

/// Line of `ledger.jsonl`: the ledger of a video, which accounts for every second.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LedgerLine {
    pub name: String,
    pub file: String,
    /// Split; `None`: no samples, or samples in several splits (`blocks`).
    pub split: Option<Split>,
    /// Time blocks with their splits; empty for a video that is in one split.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub blocks: Vec<TimeBlock>,
    /// Stage that failed, and its error; `None`: no failure.
    pub failure: Option<String>,
    #[serde(flatten)]
    pub ledger: Ledger,
}

/// Factory of the writer for an assembled file, by file name.
pub type FileFactory<'a> = dyn FnMut(&str) -> Result<Box<dyn Write>> + 'a;

/// Assembles the dataset in `dir` in place.
pub fn assemble(dir: &Path, about: &About, compared: &SoundComparison) -> Result<(DatasetInfo, DatasetStats)> {
    assemble_into(dir, about, compared, &mut |name| {
        let path = dir.join(name);
        let file = File::create(&path).with_context(|| format!("cannot write {}", path.display()))?;
        Ok(Box::new(BufWriter::new(file)))
    })
}

/// Assembles the dataset in `dir` into the writers that `open` returns.
pub fn assemble_into(
    dir: &Path,
    about: &About,
    compared: &SoundComparison,
    open: &mut FileFactory,
) -> Result<(DatasetInfo, DatasetStats)> {
    let mut checksums = BTreeMap::new();
    let mut index = HashedFile::new(INDEX, open)?;
    let mut ledger = HashedFile::new(LEDGER, open)?;
    let mut splits: BTreeMap<Split, SplitInfo> = Split::ALL.map(|split| (split, SplitInfo::default())).into();
    let (mut videos, mut bones, mut stats_collector) =
        (Vec::new(), Vec::<VideoBones>::new(), StatsCollector::default());
    let mut blocks_by_video: BTreeMap<String, Vec<TimeBlock>> = BTreeMap::new();
    let mut has_interlocutor = false;
    for name in entry::names(dir)? {
        let path = VideoEntry::path(dir, &name);
        let entry = VideoEntry::read(&path)?;
        checksums.extend(entry.files());
        checksums.insert(format!("{}/{name}.json", entry::FOLDER), orator_base::stage::fingerprint::hash_file(&path)?);
        stats_collector.push(&entry);
        entry.samples.iter().try_for_each(|sample| index.line(sample))?;
        has_interlocutor |= entry.samples.iter().any(|sample| sample.interlocutor.is_some());
        let n_frames: usize = entry.samples.iter().map(|sample| sample.n_frames).sum();
        if !entry.samples.is_empty() {
            bones.push(entry.bones.clone());
            blocks_by_video.insert(name.clone(), entry.blocks_with_splits());
        }
        for split in Split::ALL.into_iter().filter(|split| entry.samples.iter().any(|sample| sample.split == *split)) {
            let own = entry.samples.iter().filter(|sample| sample.split == split);
            let info = splits.entry(split).or_default();
            info.shards.extend(entry.shards.iter().filter(|shard| entry.split_of(shard) == Some(split)).cloned());
            info.videos.push(name.clone());
            info.samples += own.clone().count();
            info.frames += own.map(|sample| sample.n_frames).sum::<usize>();
            info.secs = about.fps.secs(info.frames);
        }
        videos.push(DatasetVideo {
            name: name.clone(),
            file: entry.file.clone(),
            content: entry.content,
            split: entry.split,
            split_by: entry.split_by,
            blocks: entry.blocks.clone(),
            samples: entry.samples.len(),
            secs: about.fps.secs(n_frames),
        });
        let (file, split, failure, of_video) = (entry.file, entry.split, entry.failure, entry.ledger);
        let blocks = entry.blocks;
        ledger.line(&LedgerLine { name, file, split, blocks, failure, ledger: of_video })?;
    }
    checksums.insert(INDEX.to_owned(), index.finish()?);
    checksums.insert(LEDGER.to_owned(), ledger.finish()?);
    let leakage = Leakage::new(compared, &blocks_by_video);
    let stats = stats_collector.finish();
    let info = DatasetInfo::new(about, &of_speaker(&bones), splits, videos);
    let info = if stats.footage.words.is_some() { info.with_words() } else { info };
    let info = if stats.posture.is_some() { info.with_posture() } else { info };
    let info = if has_interlocutor { info.with_interlocutor() } else { info };
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

/// Writer that hashes what it writes.
struct HashedFile {
    name: &'static str,
    to: Box<dyn Write>,
    hasher: blake3::Hasher,
}

impl HashedFile {
    fn new(name: &'static str, open: &mut FileFactory) -> Result<Self> {
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

/// Writer of a dataset. Memory: one sample, and the index entries of one video's samples.
pub struct DatasetWriter {
    dir: PathBuf,
    about: About,
    max_shard_bytes: u64,
    compared: SoundComparison,
}

impl DatasetWriter {
    /// Starts a dataset in the existing, empty folder `dir`. A shard is closed before it would exceed
    /// `max_shard_bytes`.
    pub fn new(dir: &Path, about: About, max_shard_bytes: u64) -> Self {
        Self { dir: dir.to_owned(), about, max_shard_bytes, compared: SoundComparison::default() }
    }

    /// Sets the result of comparing the videos' sound.
    pub fn with_compared(self, compared: SoundComparison) -> Self {
        Self { compared, ..self }
    }

    /// Starts a video; call `finish` on the result. Videos may be written in any order.
    pub fn video(&self, source: VideoSource, split: Split, split_by: SplitBy) -> Result<EntryWriter> {
        EntryWriter::new(&self.dir, source, Some(split), split_by, self.max_shard_bytes)
    }

    /// Starts a video with samples in several splits, cut from `blocks`.
    pub fn video_in_blocks(&self, source: VideoSource, blocks: Vec<TimeBlock>) -> Result<EntryWriter> {
        let writer = EntryWriter::new(&self.dir, source, None, SplitBy::Time, self.max_shard_bytes)?;
        Ok(writer.with_blocks(blocks))
    }

    /// Assembles the common files of the dataset.
    pub fn finish(self) -> Result<(DatasetInfo, DatasetStats)> {
        assemble(&self.dir, &self.about, &self.compared)
    }
}
