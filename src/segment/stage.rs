//! The stage: reads what `extract` and `pose2d` wrote of a video, judges it, writes `intervals.json`, `ledger.json`
//! and `measures.npz`.

use super::measure::{Measures, shot_numbers};
use super::rules::{Loudness, Video, judge};
use crate::config;
use crate::motion::keypoints_npz;
use crate::motion::npz::Npz;
use crate::stage::ledger::{Ledger, longest_first};
use crate::stage::progress::Progress;
use crate::stage::runner::place;
use crate::stage::{Input, Report, Stage, Unit};
use crate::types::interval::Intervals;
use crate::types::time::FrameRate;
use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Keypoints to intervals worth keeping.
pub struct SegmentStage {
    rules: config::Segment,
    work: PathBuf,
}

impl SegmentStage {
    /// Judges by `rules`; reads the earlier stages' files under the folder `work`.
    pub fn new(rules: &config::Segment, work: &Path) -> Self {
        Self { rules: rules.clone(), work: work.to_owned() }
    }

    fn file(&self, stage: &str, unit: &Unit, name: &str) -> PathBuf {
        place(&self.work, stage, unit).join(name)
    }
}

/// What is needed of `media.json`.
#[derive(Deserialize)]
struct Media {
    duration_secs: f64,
    n_frames: usize,
    fps: FrameRate,
}

impl Stage for SegmentStage {
    fn name(&self) -> &'static str {
        "segment"
    }

    fn version(&self) -> u32 {
        2
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::json!({ "segment": self.rules })
    }

    fn inputs(&self, unit: &Unit) -> Result<Vec<Input>> {
        let input = |role: &str, path| Input { role: role.to_owned(), path };
        let mut inputs = vec![
            input("media", self.file("extract", unit, "media.json")),
            input("timeline", self.file("extract", unit, "timeline.npz")),
            input("keypoints", self.file("pose2d", unit, "keypoints.npz")),
        ];
        let sound = self.file("extract", unit, "audio.wav");
        if sound.exists() {
            inputs.push(input("sound", sound));
        }
        Ok(inputs)
    }

    fn run(&self, unit: &Unit, out: &Path, _progress: &dyn Progress) -> Result<Report> {
        let media_path = self.file("extract", unit, "media.json");
        let media = std::fs::read(&media_path).with_context(|| format!("cannot read {}", media_path.display()))?;
        let media: Media =
            serde_json::from_slice(&media).with_context(|| format!("{} is incomplete", media_path.display()))?;
        ensure!(
            media.duration_secs.is_finite() && media.duration_secs >= 0.0,
            "{}: a duration of {} s",
            media_path.display(),
            media.duration_secs
        );
        let mut timeline = Npz::open(&self.file("extract", unit, "timeline.npz"))?;
        let shot_scores = timeline.numbers("shot_score", &[Some(media.n_frames)])?;
        let keypoints = keypoints_npz::read(&self.file("pose2d", unit, "keypoints.npz"))?;
        ensure!(
            keypoints.n_frames() == media.n_frames && keypoints.fps == media.fps,
            "the keypoints have {} frames at {}, the video {} at {}: run the stage pose2d again",
            keypoints.n_frames(),
            keypoints.fps,
            media.n_frames,
            media.fps
        );
        let measures = Measures::of(&keypoints, shot_numbers(shot_scores.iter().copied(), self.rules.shot_threshold));
        let sound = loudness(&self.file("extract", unit, "audio.wav"))?;
        let video = Video { fps: media.fps, duration_secs: media.duration_secs, sound };
        let (intervals, ledger) = judge(&measures, &video, &self.rules);
        write_json(&out.join("intervals.json"), &intervals)?;
        write_json(&out.join("ledger.json"), &ledger)?;
        measures.write(&out.join("measures.npz"))?;
        Ok(report(&intervals, &ledger))
    }
}

/// Length and loudest sample of a wav file, read as a stream; `None`: there is no file, the video has no sound.
fn loudness(path: &Path) -> Result<Option<Loudness>> {
    if !path.exists() {
        return Ok(None);
    }
    let reading = || format!("cannot read {}", path.display());
    let mut wav = hound::WavReader::open(path).with_context(reading)?;
    let rate = f64::from(wav.spec().sample_rate.max(1));
    let (mut peak, mut n_samples) = (0, 0u64);
    for sample in wav.samples::<i16>() {
        peak = peak.max(sample.with_context(reading)?.unsigned_abs());
        n_samples += 1;
    }
    let peak_db = if peak == 0 { -120.0 } else { 20.0 * (f64::from(peak) / 32_768.0).log10() };
    Ok(Some(Loudness { secs: n_samples as f64 / rate, peak_db }))
}

fn report(intervals: &Intervals, ledger: &Ledger) -> Report {
    let (kept, refused) = (ledger.kept_secs(), ledger.refused_secs());
    let windows = intervals.windows_64;
    let mut line = if intervals.intervals.is_empty() {
        format!("nothing kept of {:.1} s", ledger.duration_secs)
    } else {
        format!(
            "kept {kept:.1} s of {:.1} s in {}, {} windows of 64 frames (one every 5; {} side by side)",
            ledger.duration_secs,
            counted(intervals.intervals.len(), "interval"),
            windows.stride_5,
            windows.apart
        )
    };
    if !refused.is_empty() {
        line += &format!("; refused: {}", longest_first(&refused));
    }
    let length = |r: &crate::stage::ledger::Refused| r.end_secs - r.start_secs;
    let worst = ledger.refused.iter().max_by(|a, b| length(a).total_cmp(&length(b)));
    if let (true, Some(worst)) = (intervals.intervals.is_empty(), worst) {
        line += &format!(" ({})", worst.says);
    }
    let facts = serde_json::json!({
        "duration_secs": ledger.duration_secs,
        "kept_secs": kept,
        "refused_secs": refused,
        "n_intervals": intervals.intervals.len(),
        "windows_64": windows,
    });
    Report { line, facts: facts.as_object().cloned().unwrap_or_default() }
}

fn counted(n: usize, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}

fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    let mut bytes = serde_json::to_vec_pretty(value)?;
    bytes.push(b'\n');
    std::fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
}
