//! The step before `lift` with `[lift] adapt = "auto"`: fine-tunes the body lifter on all accepted keypoints of a speaker.
//! It writes the weights that `lift` then uses; if the held-out error does not decrease, these are the general weights.

use super::body::{OUTLIER_FRAMES, TRAINED_FPS};
use super::lifter::MAX_GAP_SECS;
use super::observed::ObservedBody;
use super::stage::read_video;
use super::weights;
use anyhow::{Context, Result};
use orator_base::stage::artifacts::{self, Artifact, adapted_weights};
use orator_base::stage::fingerprint::HashCache;
use orator_base::stage::progress::Progress;
use orator_base::stage::record::Record;
use orator_base::stage::runner::{self, State};
use orator_base::stage::{Input, Report, Stage, Unit};
use orator_base::text::counted;
use orator_dataset::config::LiftConfig;
use orator_nn::lifter::adapt::fine_tune::{ROUNDS, adapt};
use orator_nn::lifter::adapt::samples::KeypointStretch;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Length of a stretch in seconds; a shorter end of an interval is left out.
const STRETCH_SECS: f64 = 6.0;
/// Every how many stretches one is held out; a speaker needs as many.
const HELD_OUT: usize = 4;
/// Largest number of stretches, chosen evenly (20 minutes), which bounds the time.
const MAX_STRETCHES: usize = 200;
/// Focal length in widths of the picture (its longer side); most cameras have 0.8 to 2, and half or twice the true
/// value still describes how much nearer points are enlarged better than none.
const FOCAL: f64 = 1.5;
/// Training steps per round, and the seed.
const STEPS: usize = 50;
const SEED: u64 = 1337;

/// The step; its units are speakers.
pub struct AdaptStage {
    settings: LiftConfig,
    work: PathBuf,
    /// Hash of the built-in body weights; `file` if weights come from a file, which is an input.
    weights: String,
    /// Videos that a speaker's lifter is adapted to.
    videos: BTreeMap<String, Vec<Unit>>,
}

impl AdaptStage {
    /// Creates the step for speakers and their segmented videos. An existing adaptation is kept for new videos: it is
    /// only made again, from all videos, if one of its own videos, a setting or the step itself changed, or by `force`.
    pub fn new(
        settings: &LiftConfig,
        work: &Path,
        videos: BTreeMap<String, Vec<Unit>>,
        (hashes, force): (&HashCache, bool),
    ) -> Self {
        let weights = weights::identity(&settings.body_weights, weights::BODY);
        let mut stage = Self { settings: settings.clone(), work: work.to_owned(), weights, videos };
        for speaker in stage.videos.keys().cloned().collect::<Vec<_>>() {
            let record = Record::read(&artifacts::adapted(work, &speaker)).filter(|_| !force);
            let (Some(record), Some(all)) = (record, stage.videos.get(&speaker).cloned()) else { continue };
            let is_recorded = |unit: &&Unit| record.fingerprint.inputs.contains_key(&role("keypoints", unit));
            stage.videos.insert(speaker.clone(), all.iter().filter(is_recorded).cloned().collect());
            let unit = Unit { speaker: speaker.clone(), video: String::new(), source: PathBuf::new() };
            if !matches!(runner::state(&stage, &unit, work, hashes), State::UpToDate(_)) {
                stage.videos.insert(speaker, all);
            }
        }
        stage
    }

    fn videos(&self, speaker: &Unit) -> &[Unit] {
        self.videos.get(&speaker.speaker).map_or(&[], Vec::as_slice)
    }

    /// Stretches of all accepted intervals of a speaker, in the order of the videos.
    fn stretches(&self, speaker: &Unit) -> Result<Vec<KeypointStretch>> {
        let mut stretches = Vec::new();
        for unit in self.videos(speaker) {
            let (keypoints, intervals) = read_video(&self.work, unit)?;
            let fps = keypoints.fps.per_sec();
            let step = fps / TRAINED_FPS;
            let [width, height] = keypoints.image_size.map(f64::from);
            let half_window = ((OUTLIER_FRAMES * step).round() as usize).max(2);
            for &interval in &intervals.intervals {
                let max_gap = (MAX_GAP_SECS * fps).round() as usize;
                let observed = ObservedBody::from_keypoints(&keypoints, interval, half_window, max_gap);
                let frames: Vec<_> = (0..interval.n_frames()).map(|t| observed.frame(t)).collect();
                let parts = frames.chunks_exact(((STRETCH_SECS * fps).round() as usize).max(1));
                stretches.extend(parts.map(|frames| KeypointStretch {
                    frames: frames.to_vec(),
                    step,
                    centre_px: [width / 2.0, height / 2.0],
                    focal_px: FOCAL * width.max(height),
                }));
            }
        }
        let n = stretches.len();
        let chosen = |i: &usize| i * MAX_STRETCHES / n != (i + 1) * MAX_STRETCHES / n;
        Ok(stretches.into_iter().enumerate().filter(|(i, _)| n <= MAX_STRETCHES || chosen(i)).map(|(_, s)| s).collect())
    }
}

/// Name of an input of a video.
fn role(what: &str, unit: &Unit) -> String {
    format!("{what} of {}", unit.video)
}

impl Stage for AdaptStage {
    fn name(&self) -> &'static str {
        artifacts::ADAPTED
    }

    fn version(&self) -> u32 {
        1
    }

    fn settings(&self, _unit: &Unit) -> serde_json::Value {
        json!({ "body_weights": self.weights, "steps": ROUNDS * STEPS, "seed": SEED })
    }

    fn inputs(&self, unit: &Unit) -> Result<Vec<Input>> {
        let files = [
            ("keypoints", Artifact::Keypoints),
            ("timeline", Artifact::Timeline),
            ("intervals", Artifact::SegmentIntervals),
        ];
        let of_video = |video: &Unit| {
            files.map(|(what, file)| Input { role: role(what, video), path: file.path(&self.work, video) })
        };
        let mut inputs: Vec<Input> = self.videos(unit).iter().flat_map(of_video).collect();
        if !self.settings.body_weights.as_os_str().is_empty() {
            inputs.push(Input { role: "body weights".to_owned(), path: self.settings.body_weights.clone() });
        }
        Ok(inputs)
    }

    fn run(&self, unit: &Unit, out: &Path, progress: &dyn Progress) -> Result<Report> {
        let mut contents = weights::body_contents(&self.settings.body_weights)?;
        let config = weights::body(&self.settings.body_weights)?.net.config().clone();
        let stretches = self.stretches(unit)?;
        let n = stretches.len();
        let (held_out, training): (Vec<_>, Vec<_>) =
            stretches.into_iter().enumerate().partition(|(i, _)| i % HELD_OUT == HELD_OUT - 1);
        let [training, held_out] =
            [training, held_out].map(|part| part.into_iter().map(|(_, stretch)| stretch).collect::<Vec<_>>());
        let program = env!("CARGO_PKG_VERSION");
        let mut facts = json!({ "accepted": false, "stretches": n, "program": program });
        let mut line = format!("general lifter: less than {} s of keypoints", HELD_OUT as f64 * STRETCH_SECS);
        if n >= HELD_OUT {
            let task = progress.begin(artifacts::ADAPTED, (ROUNDS * STEPS) as u64);
            let parts = [training.as_slice(), held_out.as_slice()];
            let adapted = adapt(&config, &contents.tensors, parts, (STEPS, SEED), &|| task.advance(1))
                .with_context(|| format!("cannot adapt the body lifter to {unit}"))?;
            let [before, after] = adapted.errors.map(|metres| 1000.0 * metres);
            let chosen = if adapted.is_better() { "adapted lifter" } else { "general lifter" };
            line = format!(
                "{chosen}: held-out reprojection error {before:.1} mm before and {after:.1} mm after adapting to {}",
                counted(training.len(), "stretch")
            );
            facts["accepted"] = json!(adapted.is_better());
            facts["reprojection_error_mm"] = json!({ "before": before, "after": after });
            if adapted.is_better() {
                contents.tensors = adapted.tensors;
                contents.facts["adaptation"] = facts.clone();
            }
        }
        let file = adapted_weights(&self.work, &unit.speaker);
        contents.write(&out.join(file.file_name().unwrap_or_default()))?;
        Ok(Report { line, facts: facts.as_object().cloned().unwrap_or_default() })
    }
}
