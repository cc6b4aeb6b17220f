//! Split record: the split or time blocks of every video and the reason, so that they stay when videos are added. The
//! file is outside the dataset folder, since that folder is replaced as a whole.

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

/// Reason for a video's split.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SplitBy {
    /// The content hash chose the split, in datasets of earlier versions.
    Content,
    /// The configuration or the source dataset names the split.
    Name,
    /// The video shares sound with the video of this name and is in the same split.
    SoundOf(String),
    /// The split was the furthest below its share of the seconds.
    #[default]
    Share,
    /// The video is divided into time blocks in several splits.
    Time,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SplitRule {
    /// Unit of the division: whole videos, or time blocks.
    pub unit: SplitUnit,
    /// Reason for the rule, for readers.
    pub why: String,
    /// Minimum gap between two splits of a video, seconds; 0 for whole videos.
    pub guard_secs: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedSplit {
    /// Name in the dataset, `<slug of the file's name>-<8 hex of its content>`.
    pub name: String,
    /// Split; `None`: time blocks in several splits.
    pub split: Option<Split>,
    pub by: SplitBy,
    /// Time blocks; empty for a video that is in one split.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub blocks: Vec<TimeBlock>,
}

/// Recorded splits of a speaker's videos.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SplitRecord {
    pub schema: u32,
    /// Unit of the division: whole videos, or time blocks.
    pub unit: SplitUnit,
    /// Reason for the choice of the unit, for readers.
    pub why: String,
    /// Recorded splits by the BLAKE3 of the video file.
    pub videos: BTreeMap<String, RecordedSplit>,
}

impl SplitRecord {
    /// Record without videos.
    pub fn new(unit: SplitUnit, why: String) -> Self {
        Self { schema: SCHEMA, unit, why, videos: BTreeMap::new() }
    }

    /// Reads a record; `None` if the file does not exist.
    ///
    /// # Errors
    /// A damaged file: ignoring it would move videos to other splits.
    pub fn read(path: &Path) -> Result<Option<Self>> {
        if !path.exists() {
            return Ok(None);
        }
        let bytes = input::read(path, input::MAX_TEXT).with_context(|| format!("cannot read {}", path.display()))?;
        let damaged = || {
            format!(
                "{} is damaged. It records the split of every video: restore it from a backup, or delete it to use the \
                 splits of the existing dataset",
                path.display()
            )
        };
        let record: Self = serde_json::from_slice(&bytes).with_context(damaged)?;
        ensure!(record.schema == SCHEMA, "{} has layout version {}, expected {SCHEMA}", path.display(), record.schema);
        ensure!(record.unit != SplitUnit::Auto, damaged());
        Ok(Some(record))
    }

    /// Writes the record atomically.
    pub fn write(&self, path: &Path) -> Result<()> {
        workdir::write_file(path, &pretty(self)?)
    }

    /// Removes the videos for which `is_gone` (given content hash and record) holds; videos that were placed by sound
    /// shared with one of them keep their split. Returns the number of removed videos.
    pub fn forget(&mut self, is_gone: impl Fn(&str, &RecordedSplit) -> bool) -> usize {
        let n_before = self.videos.len();
        let (gone, accepted): (BTreeMap<_, _>, BTreeMap<_, _>) =
            std::mem::take(&mut self.videos).into_iter().partition(|(content, video)| is_gone(content, video));
        self.videos = accepted;
        for video in self.videos.values_mut() {
            if matches!(&video.by, SplitBy::SoundOf(other) if gone.values().any(|gone: &RecordedSplit| gone.name == *other))
            {
                video.by = SplitBy::Share;
            }
        }
        n_before - self.videos.len()
    }
}
