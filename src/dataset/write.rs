//! Writing a dataset's folder: samples go to their split's shards one at a time, then the three JSON files are written.

use super::bones::{VideoBones, of_speaker};
use super::index::Index;
use super::info::{About, Info, SplitInfo};
use super::sample::Sample;
use super::shard::Writer;
use super::split::Split;
use super::stats::{Footage, Gatherer, Stats};
use crate::motion::bones;
use crate::types::time::FrameRate;
use anyhow::{Context, Result, ensure};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Names of the JSON files of a dataset.
pub const INFO: &str = "info.json";
pub const STATS: &str = "stats.json";
pub const INDEX: &str = "index.json";

/// Writes one dataset. Memory: one sample.
pub struct DatasetWriter {
    dir: PathBuf,
    about: About,
    writers: BTreeMap<Split, Writer>,
    splits: BTreeMap<Split, SplitInfo>,
    gatherer: Gatherer,
    keys: BTreeSet<String>,
}

impl DatasetWriter {
    /// Begins a dataset in the existing, empty folder `dir`.
    pub fn new(dir: &Path, about: About) -> Self {
        let writer = |split| (split, Writer::new(dir, split, about.max_shard_bytes));
        Self {
            dir: dir.to_owned(),
            writers: Split::ALL.map(writer).into(),
            splits: Split::ALL.map(|split| (split, SplitInfo::default())).into(),
            about,
            gatherer: Gatherer::default(),
            keys: BTreeSet::new(),
        }
    }

    /// Adds a sample of `video` (a name for people). The order of samples is the order in the shards.
    pub fn push(&mut self, split: Split, video: &str, sample: &Sample) -> Result<()> {
        let (key, fps) = (&sample.key, sample.motion.fps);
        ensure!(fps == self.about.fps, "{key} runs at {fps}, the dataset at {}", self.about.fps);
        ensure!(self.keys.insert(key.clone()), "two samples have the key {key}");
        if let Some(writer) = self.writers.get_mut(&split) {
            writer.push(sample)?;
        }
        self.gatherer.count(split.name(), sample.n_frames());
        if split == Split::Train {
            self.gatherer.learn(&sample.motion);
        }
        let info = self.splits.entry(split).or_default();
        info.samples += 1;
        info.frames += sample.n_frames();
        info.secs = fps.secs(info.frames);
        if info.videos.last().is_none_or(|last| last != video) {
            info.videos.push(video.to_owned());
        }
        Ok(())
    }

    /// Closes the shards and writes `info.json`, `stats.json` and `index.json`.
    pub fn finish(mut self, footage: Footage) -> Result<(Info, Stats)> {
        let mut index = Index { schema: super::SCHEMA, ..Index::default() };
        for (split, writer) in self.writers {
            let (shards, samples) = writer.finish()?;
            let info = self.splits.entry(split).or_default();
            info.shards = shards.iter().map(|shard| shard.file.clone()).collect();
            index.shards.extend(shards);
            index.samples.extend(samples);
        }
        let info = Info::new(self.about, self.splits);
        let stats = self.gatherer.finish(footage);
        write_json(&self.dir.join(INFO), &info)?;
        write_json(&self.dir.join(STATS), &stats)?;
        write_json(&self.dir.join(INDEX), &index)?;
        Ok((info, stats))
    }
}

fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    let mut bytes = serde_json::to_vec_pretty(value).with_context(|| format!("writing {}", path.display()))?;
    bytes.push(b'\n');
    std::fs::write(path, bytes).with_context(|| format!("writing {}", path.display()))
}

/// A whole dataset from samples in memory, in the folder `dir` (made if it is not there): what tests and small
/// experiments need. The samples' motion is left as it is; `info.json` names its median bone lengths.
pub fn write_dataset(dir: &Path, speaker: &str, fps: FrameRate, samples: &[(Split, Sample)]) -> Result<(Info, Stats)> {
    std::fs::create_dir_all(dir).with_context(|| format!("making the folder {}", dir.display()))?;
    let measure = |sample: &Sample| VideoBones {
        lengths_metres: bones::measure(&sample.motion).map(f64::from).to_vec(),
        n_frames: sample.n_frames(),
    };
    let bones: Vec<VideoBones> = samples.iter().map(|(_, sample)| measure(sample)).collect();
    let about = About {
        speaker: speaker.to_owned(),
        fps,
        bone_lengths_metres: of_speaker(&bones).map(f64::from).to_vec(),
        models: Vec::new(),
        max_shard_bytes: 256 << 20,
    };
    let mut writer = DatasetWriter::new(dir, about);
    let mut footage = Footage { n_intervals: samples.len(), ..Footage::default() };
    for (split, sample) in samples {
        writer.push(*split, &sample.key, sample)?;
        footage.secs += sample.sound.secs();
    }
    footage.kept_secs = footage.secs;
    writer.finish(footage)
}
