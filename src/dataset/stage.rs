//! The shard stage: all videos of a speaker, as `extract`, `pose2d`, `segment` and `lift` left them, become one dataset.
//! Videos are taken in the order of their keys, so that the order in which they are named has no say in the bytes.

use super::bones::{VideoBones, of_speaker};
use super::info::{About, ModelUsed};
use super::split::Split;
use super::stats::Footage;
use super::video::Video;
use super::write::DatasetWriter;
use crate::config::{self, Settings};
use crate::stage::ledger::longest_first;
use crate::stage::progress::Progress;
use crate::stage::runner::place;
use crate::stage::{Input, Report, Stage, Unit};
use crate::types::skeleton::N_BONES;
use anyhow::{Result, bail};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A speaker's videos to shards. Its unit is the speaker.
pub struct ShardStage {
    shard: config::Shard,
    work: PathBuf,
    videos: Vec<Unit>,
    models: Vec<ModelUsed>,
}

impl ShardStage {
    /// `videos` are the units of the videos, of one speaker or of several. A video whose motion is not there (a stage
    /// before failed) is left out and counted.
    pub fn new(settings: &Settings, videos: &[Unit]) -> Self {
        Self {
            shard: settings.shard.clone(),
            work: settings.work.dir.clone(),
            videos: videos.to_vec(),
            models: Vec::new(),
        }
    }

    /// Names the models that looked at the videos in `info.json`.
    pub fn with_models(self, models: Vec<ModelUsed>) -> Self {
        Self { models, ..self }
    }

    /// The speaker's videos that are ready, and how many are not.
    fn ready(&self, speaker: &Unit) -> (Vec<&Unit>, usize) {
        let own: Vec<&Unit> = self.videos.iter().filter(|video| video.speaker == speaker.speaker).collect();
        let n_all = own.len();
        let lifted = |video: &&Unit| place(&self.work, "lift", video).join("joints.npz").exists();
        let ready: Vec<&Unit> = own.into_iter().filter(lifted).collect();
        let n_left_out = n_all - ready.len();
        (ready, n_left_out)
    }
}

/// The files read of each video: stage, name, whether it may be missing.
const FILES: [(&str, &str, bool); 6] = [
    ("extract", "audio.wav", true),
    ("pose2d", "keypoints.npz", false),
    ("segment", "intervals.json", false),
    ("segment", "ledger.json", false),
    ("lift", "joints.npz", false),
    ("lift", "bones.json", false),
];

impl Stage for ShardStage {
    fn name(&self) -> &'static str {
        "shard"
    }

    fn folder(&self) -> &'static str {
        "dataset"
    }

    fn version(&self) -> u32 {
        1
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::json!({ "shard": self.shard, "models": self.models, "tool": env!("CARGO_PKG_VERSION") })
    }

    fn inputs(&self, unit: &Unit) -> Result<Vec<Input>> {
        let mut inputs = Vec::new();
        for video in self.ready(unit).0 {
            inputs.push(Input { role: format!("{} video", video.video), path: video.source.clone() });
            for (stage, name, optional) in FILES {
                let path = place(&self.work, stage, video).join(name);
                if !optional || path.exists() {
                    inputs.push(Input { role: format!("{} {name}", video.video), path });
                }
            }
        }
        Ok(inputs)
    }

    fn run(&self, unit: &Unit, out: &Path, progress: &dyn Progress) -> Result<Report> {
        let (ready, n_left_out) = self.ready(unit);
        let mut videos = ready.into_iter().map(|video| Video::open(&self.work, video)).collect::<Result<Vec<_>>>()?;
        videos.sort_by(|a, b| (&a.name, &a.content).cmp(&(&b.name, &b.content)));
        let n_before = videos.len();
        let mut seen = std::collections::BTreeSet::new();
        videos.retain(|video| seen.insert(video.content.clone()));
        let n_twice = n_before - videos.len();

        let mut footage = footage(&videos);
        videos.retain(|video| !video.intervals.intervals.is_empty());
        anyhow::ensure!(
            footage.n_videos > 0,
            "none of the videos of {} came through the stages before, so there is no dataset; \
             `orator status --why` says where each stands",
            unit.speaker
        );
        let Some(first) = videos.first() else {
            bail!(
                "no interval worth keeping in {} of {:.1} s, so there is no dataset of {}; refused: {}; \
                 the ledger.json of each video under {} says where and why",
                counted(footage.n_videos, "video"),
                footage.secs,
                unit.speaker,
                longest_first(&footage.refused_secs),
                self.work.join("segment").join(&unit.speaker).display()
            );
        };
        let contents: Vec<&str> = videos.iter().map(|video| video.content.as_str()).collect();
        let splits = Split::of_all(&contents, self.shard.validation, self.shard.test);
        let bones: Vec<VideoBones> = videos.iter().map(|video| video.bones.clone()).collect();
        let lengths: [f32; N_BONES] = of_speaker(&bones);
        let about = About {
            speaker: unit.speaker.clone(),
            fps: first.intervals.fps,
            bone_lengths_metres: lengths.iter().map(|&length| f64::from(length)).collect(),
            models: self.models.clone(),
            max_shard_bytes: u64::from(self.shard.max_mb) << 20,
        };
        let mut writer = DatasetWriter::new(out, about);
        let task = progress.begin(&format!("shard {unit}"), footage.n_intervals as u64);
        for (video, &split) in videos.iter().zip(&splits) {
            task.detail(&video.name);
            let mut samples = video.samples(&lengths)?;
            while let Some(sample) = samples.next_sample()? {
                footage.padded_sound_secs += sample.padded_secs;
                writer.push(split, &video.name, &sample.sample)?;
                task.advance(1);
            }
        }
        let (info, stats) = writer.finish(footage)?;

        let warnings = warnings(&splits, &self.shard, n_left_out, n_twice);
        let part = |split: Split| {
            let info = info.splits.get(split.name()).cloned().unwrap_or_default();
            format!("{} {:.1} s in {}", split.name(), info.secs, counted(info.samples, "interval"))
        };
        let windows: usize = stats.windows.strided.values().sum();
        let mut line = format!("{}; {windows} windows of 64 frames", Split::ALL.map(part).join(", "));
        warnings.iter().for_each(|warning| line += &format!("; warning: {warning}"));
        let secs: BTreeMap<_, _> = info.splits.iter().map(|(name, split)| (name, split.secs)).collect();
        let facts = serde_json::json!({
            "secs": secs, "windows": stats.windows, "footage": stats.footage, "warnings": warnings,
        });
        Ok(Report { line, facts: facts.as_object().cloned().unwrap_or_default() })
    }
}

/// The seconds of all videos added up.
fn footage(videos: &[Video]) -> Footage {
    let mut footage = Footage { n_videos: videos.len(), ..Footage::default() };
    for video in videos {
        footage.n_intervals += video.intervals.intervals.len();
        footage.secs += video.ledger.duration_secs;
        footage.kept_secs += video.ledger.kept_secs();
        for (reason, secs) in video.ledger.refused_secs() {
            *footage.refused_secs.entry(reason).or_default() += secs;
        }
    }
    footage
}

/// What the user should know, each with what to do.
fn warnings(splits: &[Split], shard: &config::Shard, n_left_out: usize, n_twice: usize) -> Vec<String> {
    let mut warnings = Vec::new();
    let shares = [(Split::Validation, shard.validation), (Split::Test, shard.test)];
    let empty: Vec<&str> = shares
        .into_iter()
        .filter(|&(split, share)| share > 0.0 && !splits.contains(&split))
        .map(|(split, _)| split.name())
        .collect();
    if !empty.is_empty() {
        warnings.push(format!(
            "no video for {} (a video's content chooses its split, and {} too few): add videos, or raise shard.{}",
            empty.join(" and "),
            if splits.len() == 1 { "1 video is".to_owned() } else { format!("{} videos are", splits.len()) },
            empty.join(" and shard.")
        ));
    }
    if n_left_out > 0 {
        warnings.push(format!("{} left out, a stage before failed: see `orator status`", counted(n_left_out, "video")));
    }
    if n_twice > 0 {
        warnings.push(format!("{} left out, the same content is there already", counted(n_twice, "video")));
    }
    warnings
}

fn counted(n: usize, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}
