//! What stays when videos are added: the split, or the blocks, of every video, and why. It lies outside the dataset's
//! folder, which is replaced as a whole.

use crate::config::choices::SplitUnit;
use crate::pretty;
use anyhow::{Context, Result, ensure};
use orator_base::input;
use orator_base::stage::workdir;
use orator_base::types::split::{Split, TimeBlock};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Version of the file's layout.
const SCHEMA: u32 = 1;

/// Reason of a video's split.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SplitBy {
    /// Content hash, in datasets of earlier versions.
    Content,
    /// Configuration or source dataset.
    Name,
    /// Shared sound with the video of this name, whose split it follows.
    SoundOf(String),
    /// Seconds that the split lacked of its share.
    #[default]
    Share,
    /// Blocks of time in several splits.
    Time,
}

/// What a dataset's splits are made of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SplitRule {
    /// Whole videos, or blocks of time.
    pub unit: SplitUnit,
    /// Reason in words.
    pub why: String,
    /// Least distance between two splits of a video, seconds; 0 for whole videos.
    pub guard_secs: f64,
}

/// Split of a video on record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedSplit {
    /// Name in the dataset, `<slug of the file's name>-<8 hex of its content>`.
    pub name: String,
    /// Split; `None`: blocks in several.
    pub split: Option<Split>,
    pub by: SplitBy,
    /// Blocks of time; empty for a whole video.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub blocks: Vec<TimeBlock>,
}

/// Splits of a speaker's videos on record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SplitRecord {
    pub schema: u32,
    /// Whole videos, or blocks of time.
    pub unit: SplitUnit,
    /// Reason of the choice in words.
    pub why: String,
    /// Videos by the BLAKE3 of their file.
    pub videos: BTreeMap<String, RecordedSplit>,
}

impl SplitRecord {
    /// Record without a video.
    pub fn new(unit: SplitUnit, why: String) -> Self {
        Self { schema: SCHEMA, unit, why, videos: BTreeMap::new() }
    }

    /// Reads a record; `None` where there is none.
    ///
    /// # Errors
    /// A damaged file: without it videos would move to other splits.
    pub fn read(path: &Path) -> Result<Option<Self>> {
        if !path.exists() {
            return Ok(None);
        }
        let bytes = input::read(path, input::MOST_TEXT).with_context(|| format!("cannot read {}", path.display()))?;
        let damaged = || {
            format!(
                "{} is damaged: it keeps every video in its split. Put it back from a copy, or remove it, and the \
                 splits of the dataset that is there are taken over",
                path.display()
            )
        };
        let record: Self = serde_json::from_slice(&bytes).with_context(damaged)?;
        ensure!(record.schema == SCHEMA, "{} has layout version {}", path.display(), record.schema);
        ensure!(record.unit != SplitUnit::Auto, damaged());
        Ok(Some(record))
    }

    /// Writes the record in one step.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        workdir::write_file(path, &pretty(self)?)
    }

    /// Forgets videos by content or by name; what followed one of them keeps its split. Returns how many went.
    pub fn forget(&mut self, is_gone: impl Fn(&str, &RecordedSplit) -> bool) -> usize {
        let n_before = self.videos.len();
        let (gone, kept): (BTreeMap<_, _>, BTreeMap<_, _>) =
            std::mem::take(&mut self.videos).into_iter().partition(|(content, video)| is_gone(content, video));
        self.videos = kept;
        for video in self.videos.values_mut() {
            if matches!(&video.by, SplitBy::SoundOf(other) if gone.values().any(|gone: &RecordedSplit| gone.name == *other))
            {
                video.by = SplitBy::Share;
            }
        }
        n_before - self.videos.len()
    }
}
