//! Stage `segment`: reads the outputs of `extract` and `pose2d`, applies the rules, writes `intervals.json`,
//! `ledger.json`, `measures.npz` and `sound_offset.json`.

use super::judge::judge;
use super::measure::{self, Measures};
use crate::speech::speech_rule::SpeechDetector;
use crate::{lip_sync, sound};
use anyhow::{Result, ensure};
use orator_base::stage::artifacts::{Artifact, StageName};
use orator_base::stage::ledger::{Ledger, longest_first};
use orator_base::stage::progress::Progress;
use orator_base::stage::{Input, Report, Stage, Unit, write_json};
use orator_base::text::{counted, length};
use orator_base::types::interval::Intervals;
use orator_base::types::sound::SoundOffset;
use orator_dataset::config;
use orator_dataset::decisions::{self, Decision, DecisionAction};
use orator_formats::keypoints_npz;
use orator_formats::media_json::MediaInfo;
use orator_formats::timeline_npz::Timeline;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Stage `segment`.
pub struct SegmentStage {
    rules: config::SegmentConfig,
    work: PathBuf,
    /// Speech detector; `None`: speech is detected by loudness only.
    speech: Option<SpeechDetector>,
    /// Decisions of users on any videos.
    decisions: Vec<Decision>,
}

/// Decisions that this stage applies.
const APPLIED: [DecisionAction; 3] = [DecisionAction::Accept, DecisionAction::Reject, DecisionAction::SwapHands];

impl SegmentStage {
    /// Creates the stage with `rules`; earlier stages' files are read under `work`.
    pub fn new(rules: &config::SegmentConfig, work: &Path) -> Self {
        Self { rules: rules.clone(), work: work.to_owned(), speech: None, decisions: Vec::new() }
    }

    pub fn with_speech(self, speech: Option<SpeechDetector>) -> Self {
        Self { speech, ..self }
    }

    pub fn with_decisions(self, decisions: Vec<Decision>) -> Self {
        Self { decisions, ..self }
    }

    fn file(&self, file: Artifact, unit: &Unit) -> PathBuf {
        file.path(&self.work, unit)
    }
}

impl Stage for SegmentStage {
    fn name(&self) -> &'static str {
        StageName::Segment.as_str()
    }

    fn version(&self) -> u32 {
        9
    }

    fn settings(&self, unit: &Unit) -> serde_json::Value {
        let model = self.speech.as_ref().map(SpeechDetector::used);
        let rules = config::to_stored(StageName::Segment.as_str(), &self.rules).unwrap_or_default();
        let mut settings = serde_json::json!({ "segment": rules, "speech_model": model });
        decisions::record(&decisions::of_unit(&self.decisions, unit, &APPLIED), &mut settings);
        settings
    }

    fn inputs(&self, unit: &Unit) -> Result<Vec<Input>> {
        let input = |role: &str, path| Input { role: role.to_owned(), path };
        let mut inputs = vec![
            input("media", self.file(Artifact::MediaInfo, unit)),
            input("timeline", self.file(Artifact::Timeline, unit)),
            input("keypoints", self.file(Artifact::Keypoints, unit)),
        ];
        let sound = self.file(Artifact::Sound, unit);
        if sound.exists() {
            inputs.push(input("sound", sound));
        }
        Ok(inputs)
    }

    fn run(&self, unit: &Unit, out: &Path, _progress: &dyn Progress) -> Result<Report> {
        let video = MediaInfo::read(&self.file(Artifact::MediaInfo, unit))?;
        let (measures, offset) = self.measures(unit, &video)?;
        let decided = decisions::of_unit(&self.decisions, unit, &APPLIED);
        let (intervals, ledger) = judge(&measures, &video, &self.rules, &decided);
        write_json(&Artifact::SegmentIntervals.within(out), &intervals)?;
        write_json(&Artifact::SegmentLedger.within(out), &ledger)?;
        measures.write(&Artifact::Measures.within(out))?;
        if let Some(offset) = &offset {
            write_json(&Artifact::SoundOffset.within(out), offset)?;
        }
        let mut report = report(&intervals, &ledger);
        let rule = if self.speech.is_some() { "vad" } else { "loudness" };
        report.facts.insert("speech".to_owned(), rule.into());
        report.facts.insert("sound_offset".to_owned(), serde_json::to_value(offset)?);
        report.line.extend(offset.filter(SoundOffset::is_reportable).map(|offset| format!("; {offset}")));
        report.line.extend(video.not_judged().map(|note| format!("; {note}")));
        if !decided.is_empty() {
            let _ = write!(report.line, "; decided by hand: {}", decisions::counts(&decided));
        }
        Ok(report)
    }
}

impl SegmentStage {
    fn measures(&self, unit: &Unit, video: &MediaInfo) -> Result<(Measures, Option<SoundOffset>)> {
        let path = self.file(Artifact::Keypoints, unit);
        let swaps = decisions::of_unit(&self.decisions, unit, &[DecisionAction::SwapHands]);
        let keypoints = decisions::read_keypoints(&path, &swaps)?;
        let mut extras = keypoints_npz::read_extras(&path)?;
        let n_known = extras.other_hand.nrows();
        for t in decisions::swapped(&keypoints, &swaps).into_iter().flatten().filter(|t| *t < n_known) {
            extras.other_hand.swap([t, 0], [t, 1]);
        }
        let n_frames = video.n_frames;
        ensure!(
            keypoints.n_frames() == n_frames && extras.identity.len() == n_frames && keypoints.fps == video.fps,
            "the keypoints have {} frames at {}, the video {n_frames} at {}: run the stage pose2d again",
            keypoints.n_frames(),
            keypoints.fps,
            video.fps
        );
        let timeline = Timeline::read(&self.file(Artifact::Timeline, unit))?;
        ensure!(
            timeline.n_frames() == n_frames,
            "the timeline has {} frames, the video {n_frames}: run the stage extract again",
            timeline.n_frames()
        );
        let (sound, sound_db) = sound::levels(&self.file(Artifact::Sound, unit), video.fps, n_frames)?;
        let from_keypoints = Measures::from_keypoints(&keypoints);
        let speech = match &self.speech {
            Some(detector) => detector.shares(&self.file(Artifact::Sound, unit), video.fps, n_frames)?,
            None => vec![f32::NAN; n_frames],
        };
        let (lip_sync, offset) = match &extras.face {
            Some(face) => {
                let is_speech: Vec<bool> =
                    speech.iter().zip(&sound_db).map(|(share, db)| lip_sync::is_speech(*share, *db)).collect();
                let voice = sound::openness(&self.file(Artifact::Sound, unit))?;
                let (opening, secs) = (face.opening.to_vec(), extras.time_secs.to_vec());
                let found = lip_sync::compare(&opening, &secs, &is_speech, &voice, video.fps);
                (found.score, found.offset)
            }
            None => (vec![f32::NAN; n_frames], None),
        };
        let measures = Measures {
            left_other: measure::duplicate_share(&from_keypoints.left_hand, |t| extras.other_hand[[t, 0]]),
            right_other: measure::duplicate_share(&from_keypoints.right_hand, |t| extras.other_hand[[t, 1]]),
            sound,
            sound_db,
            speech,
            lip_sync,
            frame_difference: timeline.frame_difference,
            n_persons: extras.n_persons.iter().map(|&n| n as f32).collect(),
            identity: measure::identity(&extras.identity.to_vec(), &timeline.restart, &from_keypoints.jump),
            shot_score: timeline.shot_score.iter().map(|&score| score as f32).collect(),
            ..from_keypoints
        };
        Ok((measures, offset))
    }
}

fn report(intervals: &Intervals, ledger: &Ledger) -> Report {
    let (accepted, rejected) = (ledger.accepted_secs(), ledger.rejected_secs());
    let windows = intervals.windows_64;
    let mut line = if intervals.intervals.is_empty() {
        format!("no interval accepted in {}", length(ledger.duration_secs))
    } else {
        format!(
            "accepted {} of {} in {}, {} windows of 64 frames at stride 5 ({} without overlap)",
            length(accepted),
            length(ledger.duration_secs),
            counted(intervals.intervals.len(), "interval"),
            windows.stride_5,
            windows.disjoint
        )
    };
    if intervals.resting_secs() >= 0.05 {
        let _ = write!(line, "; hands at rest for {}", length(intervals.resting_secs()));
    }
    if !rejected.is_empty() {
        let _ = write!(line, "; rejected: {}", longest_first(&rejected));
    }
    let secs = |r: &orator_base::stage::ledger::RejectedInterval| r.end_secs - r.start_secs;
    let longest = ledger.rejected.iter().max_by(|a, b| secs(a).total_cmp(&secs(b)));
    if let (true, Some(longest)) = (intervals.intervals.is_empty(), longest) {
        let _ = write!(line, " ({})", longest.message);
    }
    let facts = serde_json::json!({
        "duration_secs": ledger.duration_secs,
        "accepted_secs": accepted,
        "resting_secs": intervals.resting_secs(),
        "rejected_secs": rejected,
        "n_intervals": intervals.intervals.len(),
        "windows_64": windows,
    });
    Report { line, facts: facts.as_object().cloned().unwrap_or_default() }
}
