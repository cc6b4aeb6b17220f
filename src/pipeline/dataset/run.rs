//! Writes a speaker's dataset, video by video; parts of the existing dataset that are unchanged are reused.

use super::division::{DividedVideo, Division};
use super::video::LiftedVideo;
use anyhow::Result;
use orator_base::stage::ledger::{Ledger, RejectedInterval};
use orator_base::stage::progress::Progress;
use orator_base::stage::rejection::{FrameRejection, Rejection};
use orator_base::types::interval::Interval;
use orator_dataset::config;
use orator_dataset::leakage::SoundComparison;
use orator_dataset::shared_sound;
use orator_dataset::split::Assignment;
use orator_dataset::write::assemble::DatasetWriter;
use orator_dataset::write::entry::{self, VideoEntry, VideoSource};
use serde_json::json;
use std::collections::BTreeMap;
use std::path::Path;

/// Hashes of the audio fingerprint codes, by name of the video; only videos with audio.
pub type Sounds = BTreeMap<String, String>;

/// State while a dataset is written.
pub struct DatasetRun<'a> {
    settings: &'a config::DatasetConfig,
    out: &'a Path,
    /// Existing dataset, and its videos.
    old: &'a Path,
    before: BTreeMap<String, VideoEntry>,
    /// Number of videos reused from it.
    pub n_reused: usize,
    progress: &'a dyn Progress,
}

impl<'a> DatasetRun<'a> {
    /// Starts a dataset in the folder `out`, reusing parts of the one in `old`.
    pub fn new(settings: &'a config::DatasetConfig, out: &'a Path, old: &'a Path, progress: &'a dyn Progress) -> Self {
        Self { settings, out, old, before: valid_parts(old), n_reused: 0, progress }
    }

    /// Writes the audio fingerprint of each video, reusing that of the old dataset if unchanged. Returns the hashes.
    pub fn sounds(&self, videos: &[&LiftedVideo]) -> Result<Sounds> {
        let task = self.progress.begin("audio", videos.len() as u64);
        let mut hashes = Sounds::new();
        for video in videos {
            let before = self.before.get(&video.name).filter(|part| part.content == video.content);
            let codes = match before.map(|part| part.codes(self.old)) {
                Some(Ok(codes)) if !codes.is_empty() => Some(codes),
                _ => video.sound_codes()?,
            };
            if let Some(codes) = codes {
                hashes.insert(video.name.clone(), entry::write_sound(self.out, &video.name, &codes)?);
            }
            task.advance(1);
        }
        Ok(hashes)
    }

    pub fn compare(&self, videos: &[&LiftedVideo], sounds: &Sounds) -> Result<SoundComparison> {
        let duplicate_secs = self.settings.duplicate_secs;
        if duplicate_secs <= 0.0 {
            return Ok(SoundComparison::default());
        }
        let audible = videos.iter().filter(|v| !v.intervals.intervals.is_empty() && sounds.contains_key(&v.name));
        let names: Vec<String> = audible.map(|video| video.name.clone()).collect();
        let shared = shared_sound::find(&names, |n| entry::read_sound(self.out, &names[n]), duplicate_secs)?;
        Ok(SoundComparison { duplicate_secs, shared })
    }

    /// Writes a video to one split or in time blocks, as `placed` states, or reuses it from the old dataset.
    pub fn write(
        &mut self,
        writer: &DatasetWriter,
        video: &LiftedVideo,
        placed: Assignment,
        division: &Division,
        sounds: &Sounds,
    ) -> Result<()> {
        let (placement, rule, divided) = match &placed {
            Assignment::In(split, by) => {
                let pieces = video.intervals.intervals.iter().map(|interval| (*split, *interval)).collect();
                (json!(split), json!(by), DividedVideo { pieces, ledger: video.ledger.clone() })
            }
            Assignment::Blocks(blocks) => {
                let divided = division.divide(&video.intervals, &video.ledger, blocks)?;
                (json!(blocks), json!([division.guard_frames, division.min_frames]), divided)
            }
            Assignment::Excluded(_) => return Ok(()),
        };
        let inputs =
            json!([orator_dataset::SCHEMA, video.file, video.files_hash, placement, rule, self.settings.max_mb]);
        let inputs_hash = blake3::hash(inputs.to_string().as_bytes()).to_hex().to_string();
        if self.reuse(video, &inputs_hash)? {
            return Ok(());
        }
        let intervals: Vec<Interval> = divided.pieces.iter().map(|(_, interval)| *interval).collect();
        let words = video.transcript_stats(intervals.iter().copied());
        let source = VideoSource {
            name: video.name.clone(),
            file: video.file.clone(),
            content: video.content.clone(),
            inputs_hash,
            ledger: Ledger { words, ..divided.ledger },
            bones: video.bones.clone(),
            failure: None,
        };
        let mut part = match placed {
            Assignment::Blocks(blocks) => writer.video_in_blocks(source, blocks)?,
            Assignment::In(split, by) => writer.video(source, split, by)?,
            Assignment::Excluded(_) => return Ok(()),
        };
        if let Some(mut samples) = video.samples(&intervals)? {
            for (split, _) in divided.pieces {
                let Some(cut) = samples.next_sample()? else { break };
                part.push_to(split, &cut.sample, cut.padded_secs)?;
            }
        }
        part.finish(sounds.get(&video.name).cloned())?;
        Ok(())
    }

    /// Reuses a video of the old dataset if its inputs are unchanged. Returns whether it did.
    fn reuse(&mut self, video: &LiftedVideo, inputs_hash: &str) -> Result<bool> {
        let Some(part) = self.before.get(&video.name).filter(|part| part.inputs_hash == inputs_hash) else {
            return Ok(false);
        };
        self.n_reused += 1;
        part.link_into(self.old, self.out)?;
        Ok(true)
    }

    /// Source entry of a video that is left out as a duplicate: its accepted seconds are rejected.
    pub fn duplicate(&self, video: &LiftedVideo, of: &str, secs: f64) -> VideoSource {
        let threshold = self.settings.duplicate_secs;
        let words = video.transcript_stats(std::iter::empty());
        let mut ledger = Ledger { words, ..video.ledger.clone() };
        let why = FrameRejection::new(Rejection::Duplicate, secs, threshold);
        let rejected = ledger.accepted.drain(..).map(|accepted| {
            RejectedInterval::with_message(
                accepted.start_secs,
                accepted.end_secs,
                why,
                format!("the same {secs:.1} s are in {of}"),
            )
        });
        let rejected: Vec<RejectedInterval> = rejected.collect();
        ledger.rejected.extend(rejected);
        ledger.rejected.sort_by(|a, b| a.start_secs.total_cmp(&b.start_secs));
        let (name, file, content) = (video.unit.video.clone(), video.file.clone(), video.content.clone());
        VideoSource { name, file, content, ledger, ..VideoSource::default() }
    }
}

/// Videos of the existing dataset, without those with damaged files.
fn valid_parts(dir: &Path) -> BTreeMap<String, VideoEntry> {
    let stated = entry::stated_hashes(dir);
    let parts = entry::names(dir).unwrap_or_default().into_iter();
    let parts = parts.filter_map(|name| VideoEntry::read(&VideoEntry::path(dir, &name)).ok().map(|part| (name, part)));
    parts.filter(|(_, part)| part.is_intact(dir, &stated)).collect()
}
