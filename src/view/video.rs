//! A video of the viewer: intervals, words, strokes, sound wave, keypoints, and the avatar of an accepted interval.

use crate::project::id;
use anyhow::{Result, ensure};
use ndarray::{Axis, s};
use orator_avatar::animate::export::file::{ExportContent, ExportFormat};
use orator_avatar::animate::{AnimationOptions, perform};
use orator_base::motion::posture::{self, LiftedBody};
use orator_base::stage::Unit;
use orator_base::stage::artifacts::Artifact;
use orator_base::stage::progress::Silent;
use orator_base::stage::rejection::Rejection;
use orator_base::types::interval::{Interval, Intervals};
use orator_base::types::pose2d::{Keypoints, N_BODY, N_HAND};
use orator_base::types::pose3d::Motion;
use orator_base::types::posture::Posture;
use orator_base::types::sound::SAMPLE_RATE;
use orator_dataset::config::Settings;
use orator_dataset::decisions::{self, Decision, DecisionAction};
use orator_formats::joints_npz;
use orator_formats::media_json::MediaInfo;
use orator_gesture::phases::{GesturePhase, HANDS, WristTrack, find_phases};
use orator_pipeline::sound;
use orator_report::videos::gather::{self, VideoSummary};
use orator_report::videos::gestures::part;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Peaks of the sound wave per second.
const PEAKS_PER_SEC: usize = 20;
/// Maximum duration of an avatar's motion in one reply, seconds.
const MAX_MOTION_SECS: f64 = 60.0;
/// Maximum number of frames of keypoints in one reply.
const MAX_FRAMES: usize = 600;
/// Lines between keypoints of the body, COCO-17.
const BODY_LINES: [[usize; 2]; 12] =
    [[0, 1], [0, 2], [1, 3], [2, 4], [5, 6], [5, 7], [7, 9], [6, 8], [8, 10], [5, 11], [6, 12], [11, 12]];

pub struct VideoView {
    unit: Unit,
    work: PathBuf,
    summary: VideoSummary,
    transcripts: Vec<PathBuf>,
    decisions: Vec<Decision>,
}

impl VideoView {
    pub fn new(unit: Unit, settings: &Settings, transcripts: Vec<PathBuf>, decisions: Vec<Decision>) -> Self {
        let summary = VideoSummary::read(settings, &unit);
        Self { unit, work: settings.work.dir.clone(), summary, transcripts, decisions }
    }

    fn path(&self, artifact: Artifact) -> PathBuf {
        artifact.path(&self.work, &self.unit)
    }

    /// Everything but sound, keypoints and motion.
    pub fn facts(&self) -> Value {
        let media = MediaInfo::read(&self.path(Artifact::MediaInfo)).ok();
        let [width, height] = media.as_ref().map_or([0, 0], |media| media.image_size);
        let ledger = &self.summary.ledger;
        let span = |start: f64, end: f64| json!([start, end]);
        let rejected = ledger.rejected.iter().map(|rejected| {
            json!([rejected.start_secs, rejected.end_secs, Rejection::label(&rejected.reason), rejected.message])
        });
        let failed = ledger.failed.iter();
        let failed = failed.map(|failed| json!([failed.start_secs, failed.end_secs, "failed", failed.error]));
        let of = |action| decisions::of_unit(&self.decisions, &self.unit, &[action]);
        let words = self.summary.video_words(&self.work, &self.transcripts, &of(DecisionAction::Word));
        let words = words.map(|words| words.within(0.0, ledger.duration_secs)).unwrap_or_default();
        let motion = self.motion().ok();
        json!({
            "id": id(&self.unit), "file": self.summary.file, "width": width, "height": height,
            "fps": media.as_ref().map_or(0.0, |media| media.fps.per_sec()),
            "first_image_secs": media.as_ref().map_or(0.0, |media| media.first_image_secs),
            "n_frames": media.as_ref().map_or(0, |media| media.n_frames),
            "duration_secs": ledger.duration_secs,
            "accepted": ledger.accepted.iter().map(|own| span(own.start_secs, own.end_secs)).collect::<Vec<_>>(),
            "resting": ledger.resting.iter().map(|own| span(own.start_secs, own.end_secs)).collect::<Vec<_>>(),
            "rejected": rejected.chain(failed).collect::<Vec<_>>(),
            "words": words.iter().map(|word| json!([word.start_secs, word.end_secs, word.word])).collect::<Vec<_>>(),
            "strokes": motion.as_ref().map(strokes).unwrap_or_default(),
            "has_motion": motion.is_some(),
            "edges": lines(), "n_keypoints": N_BODY + 2 * N_HAND,
            "decisions": self.decisions,
        })
    }

    fn motion(&self) -> Result<(Motion, Intervals)> {
        ensure!(self.summary.is_lifted, "the video is not lifted yet");
        gather::motion(&self.work, &self.unit)
    }

    /// Peak of the sound in every twentieth of a second, 0 to 255.
    ///
    /// # Errors
    /// The audio file is damaged. A video without audio has no peaks.
    pub fn wave(&self) -> Result<Vec<u8>> {
        let (path, mut peaks) = (self.path(Artifact::Sound), Vec::new());
        if path.exists() {
            sound::pieces(&path, SAMPLE_RATE as usize / PEAKS_PER_SEC, |samples| {
                let peak = samples.iter().fold(0.0_f32, |peak, sample| peak.max(sample.abs()));
                peaks.push((256.0 * peak).min(255.0) as u8);
                Ok(())
            })?;
        }
        Ok(peaks)
    }

    /// Keypoints of `n` frames from `start`, f32 little endian [n, 59, 3]: x, y in pixels of the video file, score (NaN:
    /// not detected). Frames after the end are left out.
    ///
    /// # Errors
    /// There are no keypoints yet, or too many frames are requested.
    pub fn keypoints(&self, start: usize, n: usize) -> Result<Vec<u8>> {
        ensure!(n <= MAX_FRAMES, "{n} frames requested, at most {MAX_FRAMES} are sent at once");
        let keypoints = self.corrected_keypoints()?;
        let media = MediaInfo::read(&self.path(Artifact::MediaInfo))?;
        let last_x = media.image_size[0] as f32 - 1.0;
        let end = start.saturating_add(n).min(keypoints.n_frames());
        let mut bytes = Vec::new();
        for frame in start.min(end)..end {
            let parts = [&keypoints.body, &keypoints.left_hand, &keypoints.right_hand];
            let parts = parts.map(|part| part.index_axis(Axis(0), frame));
            for point in parts.iter().flat_map(|part| part.outer_iter()) {
                let x = if media.pictures.mirrored { last_x - point[0] } else { point[0] };
                let score = if point[2] > 0.0 { point[2] } else { f32::NAN };
                [x, point[1], score].iter().for_each(|value| bytes.extend(value.to_le_bytes()));
            }
        }
        Ok(bytes)
    }

    /// Keypoints with the hands exchanged where a decision says so.
    fn corrected_keypoints(&self) -> Result<Keypoints> {
        let swaps = decisions::of_unit(&self.decisions, &self.unit, &[DecisionAction::SwapHands]);
        decisions::read_keypoints(&self.path(Artifact::Keypoints), &swaps)
    }

    /// Avatar with the motion from `start_secs` to `end_secs` as GLB.
    ///
    /// # Errors
    /// The range is empty, longer than a minute or beyond the video; the video is not lifted; no arm is visible.
    pub fn avatar(&self, start_secs: f64, end_secs: f64) -> Result<Vec<u8>> {
        let (motion, _) = self.motion()?;
        let keypoints = self.corrected_keypoints()?;
        let extra = joints_npz::read_extra(&self.path(Artifact::Joints))?;
        let fps = motion.fps.per_sec();
        ensure!(
            start_secs >= 0.0 && end_secs > start_secs && end_secs - start_secs <= MAX_MOTION_SECS + 1e-6,
            "invalid range {start_secs} to {end_secs} s: expected at most {MAX_MOTION_SECS} s"
        );
        let frames = (start_secs * fps).round() as usize..((end_secs * fps).round() as usize).min(motion.n_frames());
        ensure!(!frames.is_empty(), "there is no motion from {start_secs} to {end_secs} s");
        let part = part(&motion, frames.start, frames.end);
        ensure!(part.mask.iter().any(|is_visible| *is_visible), "no joint is visible in this range");
        let body = keypoints.body.slice(s![frames.clone(), .., ..]).to_owned();
        let extra = extra.map(|extra| extra.slice(s![frames, .., ..]).to_owned());
        let lifted = LiftedBody { joints: Some(part.joints.view()), extra: extra.as_ref().map(|extra| extra.view()) };
        let posture = posture::estimate(body.view(), lifted);
        glb(&part, Some(&posture))
    }
}

/// Avatar with `motion` as the bytes of a GLB file.
///
/// # Errors
/// The temporary file cannot be written.
pub(crate) fn glb(motion: &Motion, posture: Option<&Posture>) -> Result<Vec<u8>> {
    let performance = perform(motion, posture, &AnimationOptions::default());
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("avatar.glb");
    ExportFormat::Glb.write(&path, &performance, &ExportContent::default(), &Silent)?;
    Ok(std::fs::read(path)?)
}

/// Phases of both hands in the accepted intervals: hand, phase, start and end in seconds.
fn strokes((motion, intervals): &(Motion, Intervals)) -> Vec<Value> {
    let inside = |interval: &&Interval| interval.end <= motion.n_frames();
    let parts: Vec<(f64, Motion)> = intervals
        .intervals
        .iter()
        .filter(inside)
        .map(|own| (motion.fps.secs(own.start), part(motion, own.start, own.end)))
        .collect();
    let mut phases = Vec::new();
    for (side, name) in HANDS {
        let tracks: Vec<WristTrack> = parts.iter().map(|(_, part)| WristTrack::new(part, side)).collect();
        for ((start_secs, _), found) in parts.iter().zip(find_phases(&tracks)) {
            let row = |phase: &GesturePhase| {
                json!([name, phase.kind.name(), start_secs + phase.start_secs, start_secs + phase.end_secs])
            };
            phases.extend(found.iter().map(row));
        }
    }
    phases
}

/// Lines between keypoints of body, left hand and right hand.
fn lines() -> Vec<[usize; 2]> {
    let hand = |first: usize| (1..N_HAND).map(move |k| [first + if k % 4 == 1 { 0 } else { k - 1 }, first + k]);
    BODY_LINES.into_iter().chain(hand(N_BODY)).chain(hand(N_BODY + N_HAND)).collect()
}
