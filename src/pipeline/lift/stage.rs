//! Stage `lift`: reads the keypoints and accepted intervals of a video; writes `joints.npz`, `bones.json`,
//! `camera.json` (roll and pitch per interval), `bone_change.npz` (input of the outlier detection), and the final
//! `intervals.json` and `ledger.json`.

use super::outliers::{self, BoneChange};
use super::reject::{exclude_frames, max_gap_frames};
use super::{Lifted, Lifter, weights};
use anyhow::{Context, Result, ensure};
use ndarray::{Array1, s};
use orator_base::stage::artifacts::{Artifact, StageName};
use orator_base::stage::ledger::{Ledger, longest_first};
use orator_base::stage::progress::Progress;
use orator_base::stage::{Input, Report, Stage, Unit, write_json};
use orator_base::text::{counted, length};
use orator_base::types::interval::{Interval, Intervals};
use orator_base::types::pose2d::Keypoints;
use orator_dataset::config;
use orator_dataset::decisions::{self, Decision, DecisionAction};
use orator_formats::timeline_npz::Timeline;
use orator_formats::{joints_npz, npz};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Stage `lift`.
pub struct LiftStage {
    lifter: Lifter,
    settings: config::LiftConfig,
    rules: config::SegmentConfig,
    work: PathBuf,
    /// Hashes of the built-in body and hand weights; `file` if weights come from a file, which is an input.
    weights: [String; 2],
    /// Decisions of users on any videos.
    decisions: Vec<Decision>,
}

impl LiftStage {
    /// Creates the stage. `settings` control lifting and the check of the bones, `rules` the lengths of pieces and
    /// gaps. Earlier stages' files are read under `work`.
    ///
    /// # Errors
    /// Weights that cannot be loaded.
    pub fn new(settings: &config::LiftConfig, rules: &config::SegmentConfig, work: &Path) -> Result<Self> {
        let lifter = Lifter::new(settings)?;
        let hash = |file: &Path, builtin: &[u8]| {
            let is_builtin = file.as_os_str().is_empty();
            if is_builtin { blake3::hash(builtin).to_hex().to_string() } else { "file".to_owned() }
        };
        let weights = [hash(&settings.body_weights, weights::BODY), hash(&settings.hand_weights, weights::HANDS)];
        let (settings, rules, work) = (settings.clone(), rules.clone(), work.to_owned());
        Ok(Self { lifter, settings, rules, work, weights, decisions: Vec::new() })
    }

    pub fn with_decisions(self, decisions: Vec<Decision>) -> Self {
        Self { decisions, ..self }
    }

    fn swaps(&self, unit: &Unit) -> Vec<&Decision> {
        decisions::of_unit(&self.decisions, unit, &[DecisionAction::SwapHands])
    }

    fn file(&self, file: Artifact, unit: &Unit) -> PathBuf {
        file.path(&self.work, unit)
    }
}

impl Stage for LiftStage {
    fn name(&self) -> &'static str {
        StageName::Lift.as_str()
    }

    fn version(&self) -> u32 {
        11
    }

    fn settings(&self, unit: &Unit) -> serde_json::Value {
        let mut settings = json!({
            "lift": {
                "body_weights": self.weights[0],
                "hand_weights": self.weights[1],
                "smooth_arms": self.settings.smooth_arms,
                "smooth_hands": self.settings.smooth_hands,
                "level": self.settings.level,
                "max_bone_change": self.settings.max_bone_change,
            },
            "segment": {
                "min_frames": self.rules.min_frames,
                "max_body_gap_secs": self.rules.max_body_gap_secs,
            },
        });
        decisions::record(&self.swaps(unit), &mut settings);
        settings
    }

    fn inputs(&self, unit: &Unit) -> Result<Vec<Input>> {
        let input = |role: &str, path| Input { role: role.to_owned(), path };
        let mut inputs = vec![
            input("timeline", self.file(Artifact::Timeline, unit)),
            input("keypoints", self.file(Artifact::Keypoints, unit)),
            input("intervals", self.file(Artifact::SegmentIntervals, unit)),
            input("ledger", self.file(Artifact::SegmentLedger, unit)),
        ];
        let weights = [("body weights", &self.settings.body_weights), ("hand weights", &self.settings.hand_weights)];
        let given = weights.into_iter().filter(|(_, path)| !path.as_os_str().is_empty());
        inputs.extend(given.map(|(role, path)| input(role, path.clone())));
        Ok(inputs)
    }

    fn run(&self, unit: &Unit, out: &Path, _progress: &dyn Progress) -> Result<Report> {
        let (mut keypoints, _) = self.keypoints(unit)?;
        let path = self.file(Artifact::SegmentIntervals, unit);
        let bytes = std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
        let intervals: Intervals = serde_json::from_slice(&bytes)
            .with_context(|| format!("{} is not a list of intervals: run the stage segment again", path.display()))?;
        ensure!(
            intervals.n_frames == keypoints.n_frames(),
            "the keypoints have {} frames, {} states {}: run the stage segment again",
            keypoints.n_frames(),
            path.display(),
            intervals.n_frames
        );
        let ledger = Ledger::read(&self.file(Artifact::SegmentLedger, unit))?;
        let (accepted_secs, before) = (ledger.accepted_secs(), ledger.rejected_secs());
        let (lifted, intervals, ledger) = self.lift(&mut keypoints, intervals, ledger, out)?;
        joints_npz::write_lifted(&Artifact::Joints.within(out), &lifted.motion, &lifted.extra)?;
        let bones = json!({ "lengths_metres": lifted.lengths.to_vec(), "n_frames": lifted.n_frames });
        write_json(&Artifact::Bones.within(out), &bones)?;
        let camera = json!({ "levelled": self.settings.level, "intervals": lifted.cameras });
        write_json(&Artifact::Camera.within(out), &camera)?;
        write_json(&Artifact::LiftIntervals.within(out), &intervals)?;
        write_json(&Artifact::LiftLedger.within(out), &ledger)?;
        let n_visible = lifted.motion.mask.iter().filter(|m| **m).count();
        let n_known = lifted.motion.joints.iter().filter(|v| v.is_finite()).count() / 3;
        let filled = 100.0 * (1.0 - n_visible as f64 / n_known.max(1) as f64);
        let mut newly = ledger.rejected_secs();
        newly.iter_mut().for_each(|(reason, secs)| *secs -= before.get(reason).copied().unwrap_or(0.0));
        let rejected = match accepted_secs - ledger.accepted_secs() {
            secs if secs < 0.05 => String::new(),
            secs => format!("; {} of {} rejected: {}", length(secs), length(accepted_secs), longest_first(&newly)),
        };
        let line = match lifted.n_frames {
            0 => format!("no interval to lift{rejected}"),
            n => {
                let intervals = counted(intervals.intervals.len(), "interval");
                format!("{n} frames in {intervals}, {filled:.1} % of the joint positions interpolated{rejected}")
            }
        };
        let facts = json!({ "n_frames": lifted.n_frames, "filled_percent": filled });
        Ok(Report { line, facts: facts.as_object().cloned().unwrap_or_default() })
    }
}

impl LiftStage {
    /// Keypoints of the video, without the points of repeated frames, and its timeline.
    fn keypoints(&self, unit: &Unit) -> Result<(Keypoints, Timeline)> {
        let mut keypoints = decisions::read_keypoints(&self.file(Artifact::Keypoints, unit), &self.swaps(unit))?;
        let path = self.file(Artifact::Timeline, unit);
        let timeline = Timeline::read(&path)?;
        ensure!(
            timeline.n_frames() == keypoints.n_frames(),
            "the keypoints have {} frames, {} has {}: run the stage pose2d again",
            keypoints.n_frames(),
            path.display(),
            timeline.n_frames()
        );
        hide_repeated_frames(&mut keypoints, &timeline.repeated);
        Ok((keypoints, timeline))
    }

    /// Lifts every frame of a video in which the speaker is visible, fit for training or not, each shot by itself; also
    /// returns the keypoints. Only the stages `extract` and `pose2d` must be done.
    ///
    /// # Errors
    /// Files of these stages that cannot be read.
    pub fn lift_visible(&self, unit: &Unit) -> Result<(Keypoints, Lifted)> {
        let (keypoints, Timeline { shot_score, .. }) = self.keypoints(unit)?;
        let is_cut = |t: &usize| shot_score[*t] > 0.0 && shot_score[*t] >= self.rules.shot_threshold;
        let cuts = (1..keypoints.n_frames()).filter(is_cut);
        let bounds: Vec<usize> = std::iter::once(0).chain(cuts).chain([keypoints.n_frames()]).collect();
        let shots: Vec<Interval> = bounds.windows(2).map(|pair| Interval { start: pair[0], end: pair[1] }).collect();
        let lifted = self.lifter.lift_intervals(&keypoints, &shots)?;
        Ok((keypoints, lifted))
    }

    /// Lifts, and removes frames with errors from intervals and ledger. Writes `bone_change.npz`: `bone_change` f32
    /// [T], the largest relative deviation of a bone in each frame from its length in the video.
    fn lift(
        &self,
        keypoints: &mut Keypoints,
        mut intervals: Intervals,
        mut ledger: Ledger,
        out: &Path,
    ) -> Result<(Lifted, Intervals, Ledger)> {
        let (most, min_frames) = (self.settings.max_bone_change, self.rules.min_frames);
        let mut raw = self.lifter.raw(keypoints, &intervals.intervals, &intervals.resting)?;
        let change = BoneChange::measure(&raw.motion);
        if change.exceeds(most) {
            let rejections = change.judge(most, max_gap_frames(&self.rules, keypoints.fps), keypoints);
            (intervals, ledger) = exclude_frames(&intervals, &ledger, &rejections, min_frames)?;
            raw = self.lifter.raw(keypoints, &intervals.intervals, &intervals.resting)?;
        }
        let open = outliers::missing_joint_rejections(&raw.motion, &intervals.intervals);
        (intervals, ledger) = exclude_frames(&intervals, &ledger, &open, min_frames)?;
        let largest = Array1::from_vec(change.largest());
        npz::write(&Artifact::BoneChange.within(out), |npz| npz.add_array("bone_change", &largest))?;
        Ok((self.lifter.finish(raw, &intervals.intervals), intervals, ledger))
    }
}

/// Hides the points of repeated frames, so that the motion there is interpolated and masked instead of stopping.
fn hide_repeated_frames(keypoints: &mut Keypoints, repeated: &[bool]) {
    for points in [&mut keypoints.body, &mut keypoints.left_hand, &mut keypoints.right_hand] {
        for (mut frame, _) in points.outer_iter_mut().zip(repeated).filter(|(_, repeated)| **repeated) {
            frame.slice_mut(s![.., 2]).fill(0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lift::Lifter;
    use crate::test_keypoints::bodies;
    use orator_base::types::pose2d::coco::{L_ELBOW, L_SHOULDER, L_WRIST, NOSE, R_ELBOW, R_SHOULDER, R_WRIST};
    use orator_base::types::skeleton;

    /// A steadily rising arm, filmed at 10 fps and played at 15: every third frame repeats the previous one.
    #[test]
    fn repeated_frames_are_masked_and_interpolated() {
        let n_frames = 45;
        let repeated: Vec<bool> = (0..n_frames).map(|t| t % 3 == 1).collect();
        let mut keypoints = bodies(n_frames, [640, 480], |t| {
            let filmed = (t - usize::from(repeated[t])) as f32;
            [
                (NOSE, 320.0, 130.0),
                (L_SHOULDER, 390.0, 200.0),
                (R_SHOULDER, 250.0, 200.0),
                (L_ELBOW, 410.0, 310.0),
                (R_ELBOW, 230.0, 310.0),
                (L_WRIST, 400.0, 390.0 - 4.0 * filmed),
                (R_WRIST, 240.0, 390.0),
            ]
        });
        hide_repeated_frames(&mut keypoints, &repeated);
        let motion = Lifter::new(&config::LiftConfig::default()).unwrap().lift(&keypoints).unwrap();
        let wrist = skeleton::L_WRIST;
        for (t, is_repeated) in repeated.iter().enumerate().take(n_frames - 3).skip(3) {
            assert_eq!(motion.mask[[t, wrist]], !is_repeated, "frame {t}");
        }
        let rises = |t: usize| motion.joints[[t, wrist, 1]] - motion.joints[[t + 1, wrist, 1]];
        let (least, most) = (6..n_frames - 7).map(rises).fold((f32::MAX, 0.0_f32), |(a, b), v| (a.min(v), b.max(v)));
        assert!(least > 0.3 * most, "steps of the wrist from {least} to {most} m");
    }
}
