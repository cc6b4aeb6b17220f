//! Writing of a dataset's folder: the videos, then the common files.

use super::assemble::assemble;
use super::part::{EntryWriter, VideoSource};
use crate::info::{About, DatasetInfo};
use crate::leakage::SoundComparison;
use crate::split::{Split, SplitBy, TimeBlock};
use crate::stats::DatasetStats;
use anyhow::Result;
use std::path::{Path, PathBuf};

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
