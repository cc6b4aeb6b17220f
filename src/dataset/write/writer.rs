//! Writing of a dataset's folder: the videos, then the common files.

use super::assemble::assemble;
use super::part::{EntryWriter, VideoSource};
use crate::dataset::bones::VideoBones;
use crate::dataset::info::{About, DatasetInfo};
use crate::dataset::leakage::SoundComparison;
use crate::dataset::sample::Sample;
use crate::dataset::split::Split;
use crate::dataset::split::SplitBy;
use crate::dataset::stats::DatasetStats;
use crate::motion::bones;
use crate::stage::ledger::{Kept, Ledger};
use crate::types::time::FrameRate;
use anyhow::{Context, Result};
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
        EntryWriter::new(&self.dir, source, split, split_by, self.max_shard_bytes)
    }

    /// Assembles the dataset from its videos.
    pub fn finish(self) -> Result<(DatasetInfo, DatasetStats)> {
        assemble(&self.dir, &self.about, &self.compared)
    }
}

/// Writes a dataset from samples in memory into the folder `dir` (made if missing), for tests and small experiments.
/// Samples whose keys differ only behind the last dash belong to one video and are adjacent. Motion stays as it is; the
/// video's bones are its median lengths.
pub fn write_dataset(
    dir: &Path,
    speaker: &str,
    fps: FrameRate,
    samples: &[(Split, Sample)],
) -> Result<(DatasetInfo, DatasetStats)> {
    std::fs::create_dir_all(dir).with_context(|| format!("making the folder {}", dir.display()))?;
    let writer = DatasetWriter::new(dir, About::new(speaker, fps), 256 << 20);
    let video_of =
        |sample: &Sample| sample.key.rsplit_once('-').map_or(sample.key.clone(), |(video, _)| video.to_owned());
    for of_video in samples.chunk_by(|a, b| video_of(&a.1) == video_of(&b.1)) {
        let Some((split, first)) = of_video.first() else { continue };
        let measured = of_video.iter().map(|(_, sample)| VideoBones {
            lengths_metres: bones::measure(&sample.motion).map(f64::from).to_vec(),
            n_frames: sample.n_frames(),
        });
        let lengths = crate::dataset::bones::of_speaker(&measured.collect::<Vec<_>>());
        let mut n_frames = 0;
        let kept = of_video.iter().map(|(_, sample)| {
            let start = n_frames;
            n_frames += sample.n_frames();
            Kept { start_secs: fps.secs(start), end_secs: fps.secs(n_frames) }
        });
        let kept: Vec<Kept> = kept.collect();
        let duration_secs = fps.secs(n_frames);
        let name = video_of(first);
        let source = VideoSource {
            file: format!("{name}.mp4"),
            content: blake3::hash(name.as_bytes()).to_hex().to_string(),
            name,
            ledger: Ledger { duration_secs, kept, ..Ledger::default() },
            bones: VideoBones { lengths_metres: lengths.map(f64::from).to_vec(), n_frames },
            ..VideoSource::default()
        };
        let mut video = writer.video(source, *split, SplitBy::Name)?;
        of_video.iter().try_for_each(|(_, sample)| video.push(sample, 0.0))?;
        video.finish(None)?;
    }
    writer.finish()
}
