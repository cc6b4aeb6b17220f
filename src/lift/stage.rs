//! The stage: reads the keypoints of a video and the intervals worth keeping, writes `joints.npz` and `bones.json`.

use super::Lifter;
use crate::config;
use crate::motion::{joints_npz, keypoints_npz};
use crate::stage::{Input, Report, Stage, Unit, progress::Progress, runner::place};
use crate::types::interval::Intervals;
use anyhow::{Context, Result, ensure};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Lifts videos.
pub struct LiftStage {
    lifter: Lifter,
    settings: config::Lift,
    work: PathBuf,
}

impl LiftStage {
    /// Lifts as `settings` say; reads the earlier stages' files under the folder `work`. Errors: weights that cannot
    /// be loaded.
    pub fn new(settings: &config::Lift, work: &Path) -> Result<Self> {
        Ok(Self { lifter: Lifter::new(settings)?, settings: settings.clone(), work: work.to_owned() })
    }

    fn keypoints(&self, unit: &Unit) -> PathBuf {
        place(&self.work, "pose2d", unit).join("keypoints.npz")
    }

    fn intervals(&self, unit: &Unit) -> PathBuf {
        place(&self.work, "segment", unit).join("intervals.json")
    }
}

impl Stage for LiftStage {
    fn name(&self) -> &'static str {
        "lift"
    }

    fn version(&self) -> u32 {
        1
    }

    fn settings(&self) -> serde_json::Value {
        // the weights of a file are an input; of the built-in ones the hash stands here
        let hash = |file: &Path, builtin: &[u8]| match file.as_os_str().is_empty() {
            true => json!(blake3::hash(builtin).to_hex().as_str()),
            false => json!("file"),
        };
        json!({
            "body_weights": hash(&self.settings.body_weights, super::weights::BODY),
            "hand_weights": hash(&self.settings.hand_weights, super::weights::HANDS),
            "smooth_arms": self.settings.smooth_arms,
            "smooth_hands": self.settings.smooth_hands,
        })
    }

    fn inputs(&self, unit: &Unit) -> Result<Vec<Input>> {
        let input = |role: &str, path| Input { role: role.to_owned(), path };
        let mut inputs = vec![input("keypoints", self.keypoints(unit)), input("intervals", self.intervals(unit))];
        for (role, path) in
            [("body weights", &self.settings.body_weights), ("hand weights", &self.settings.hand_weights)]
        {
            if !path.as_os_str().is_empty() {
                inputs.push(input(role, path.clone()));
            }
        }
        Ok(inputs)
    }

    fn run(&self, unit: &Unit, out: &Path, _progress: &dyn Progress) -> Result<Report> {
        let keypoints = keypoints_npz::read(&self.keypoints(unit))?;
        let path = self.intervals(unit);
        let bytes = std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
        let intervals: Intervals =
            serde_json::from_slice(&bytes).with_context(|| format!("{} holds no intervals", path.display()))?;
        ensure!(
            intervals.n_frames == keypoints.n_frames(),
            "the keypoints have {} frames, {} speaks of {}: run the stage segment again",
            keypoints.n_frames(),
            path.display(),
            intervals.n_frames
        );
        let lifted = self.lifter.lift_intervals(&keypoints, &intervals.intervals)?;
        joints_npz::write(&out.join("joints.npz"), &lifted.motion)?;
        let bones = json!({ "lengths_metres": lifted.lengths.to_vec(), "n_frames": lifted.n_frames });
        let mut bytes = serde_json::to_vec_pretty(&bones)?;
        bytes.push(b'\n');
        let path = out.join("bones.json");
        std::fs::write(&path, bytes).with_context(|| format!("cannot write {}", path.display()))?;
        let seen = lifted.motion.mask.iter().filter(|m| **m).count();
        let told = lifted.motion.joints.iter().filter(|v| v.is_finite()).count() / 3;
        let filled = 100.0 * (1.0 - seen as f64 / told.max(1) as f64);
        let line = match lifted.n_frames {
            0 => "nothing to lift".to_owned(),
            n => format!("{n} frames in {} intervals, {filled:.1} % of the joints filled", intervals.intervals.len()),
        };
        let facts = json!({ "n_frames": lifted.n_frames, "filled_percent": filled });
        Ok(Report { line, facts: facts.as_object().cloned().unwrap_or_default() })
    }
}
