//! Time budget: how many seconds of each video were accepted, rejected (by reason), lost to a failed stage or are
//! still pending, and whether these add up to the duration of the video.

use orator_base::stage::Unit;
use orator_base::stage::artifacts::{Artifact, StageName};
use orator_base::stage::ledger::Ledger;
use orator_base::types::sound::SoundOffset;
use orator_formats::media_json::MediaInfo;
use orator_formats::sound_offset_json;
use orator_media::ffmpeg::probe::probe;
use serde::{Serialize, Serializer};
use std::collections::BTreeMap;
use std::path::Path;

/// Tolerance where the frame rate is unknown: one frame at the lowest dataset rate in common use.
const UNKNOWN_FRAME_SECS: f64 = 1.0 / 15.0;

/// Progress of a video through the stages up to `lift`.
#[derive(Clone, Copy)]
pub(super) enum VideoProgress<'a> {
    /// Every stage up to `lift` is done, so the ledger of `lift` is valid.
    Judged,
    /// A stage failed, with its error.
    Failed { stage: StageName, error: &'a str },
    /// No stage failed, but at least one has not run.
    Waiting,
}

/// Time budget of one video, or the sum over several.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TimeBudget {
    /// `speaker/video`, or the name of the speaker.
    pub unit: String,
    /// Seconds in accepted intervals.
    #[serde(rename = "accepted_secs")]
    pub accepted: f64,
    #[serde(rename = "rejected_secs")]
    pub rejected: BTreeMap<String, f64>,
    /// Seconds lost to a failed stage.
    #[serde(rename = "failed_secs")]
    pub failed: f64,
    /// Seconds of videos that have not passed all stages up to `lift`.
    #[serde(rename = "waiting_secs")]
    pub waiting: f64,
    /// Total duration of the videos whose duration is known.
    #[serde(rename = "duration_secs")]
    pub duration: f64,
    /// Sum of `accepted`, `rejected`, `failed` and `waiting`.
    #[serde(rename = "sum_secs")]
    pub sum: f64,
    /// Videos of unknown duration, because they failed before it was determined.
    #[serde(rename = "unknown_durations")]
    pub n_unknown: usize,
    /// Videos whose sum deviates from their duration by more than one frame; serialised as whether there are none.
    #[serde(rename = "adds_up", serialize_with = "serialize_is_zero")]
    pub n_mismatched: usize,
    /// Message about the criteria that were skipped, for a unit without pictures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_judged: Option<String>,
    /// Delay of the audio relative to the video, if it is reliable and large enough to be visible.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sound_offset: Option<SoundOffset>,
    /// Whether the budget covers one video or a speaker.
    pub kind: BudgetKind,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum BudgetKind {
    Video,
    /// All videos of one or several speakers.
    #[default]
    Speaker,
}

impl TimeBudget {
    /// Empty budget of a speaker, to which the budgets of videos are added.
    pub(super) fn of_speaker(speaker: &str) -> Self {
        Self { unit: speaker.to_owned(), ..Self::default() }
    }

    /// Budget of one video from the stage outputs under `work`. `is_extracted`: the extract stage is up to date.
    pub(super) fn of_video(work: &Path, unit: &Unit, progress: VideoProgress, is_extracted: bool) -> Self {
        let budget = Self { unit: unit.to_string(), kind: BudgetKind::Video, ..Self::default() };
        let media = if is_extracted { MediaInfo::read(&Artifact::MediaInfo.path(work, unit)).ok() } else { None };
        let not_judged = media.as_ref().and_then(MediaInfo::not_judged);
        let offset = sound_offset_json::read(&Artifact::SoundOffset.path(work, unit)).ok().flatten();
        let budget = Self { not_judged, sound_offset: offset.filter(SoundOffset::is_reportable), ..budget };
        let Some(duration) = media.as_ref().map(|media| media.duration_secs).or_else(|| probed_duration(&unit.source))
        else {
            return Self { n_unknown: 1, ..budget };
        };
        let (ledger, waiting) = match progress {
            VideoProgress::Judged => (Ledger::read(&Artifact::LiftLedger.path(work, unit)), 0.0),
            VideoProgress::Failed { stage, error } => (Ok(Ledger::failed(duration, stage.as_str(), error)), 0.0),
            VideoProgress::Waiting => (Ok(Ledger::default()), duration),
        };
        let unreadable = |error| Ledger::failed(duration, StageName::Lift.as_str(), &format!("{error:#}"));
        let ledger = ledger.unwrap_or_else(unreadable);
        // Adding 0.0 turns the -0.0 of an empty sum into 0.0.
        let (accepted, rejected, failed) =
            (ledger.accepted_secs() + 0.0, ledger.rejected_secs(), ledger.failed_secs() + 0.0);
        let mut budget = Self { accepted, rejected, failed, waiting, duration, ..budget };
        budget.sum = budget.total();
        let frame_secs = media.as_ref().map_or(UNKNOWN_FRAME_SECS, |media| 1.0 / media.fps.per_sec());
        budget.n_mismatched = usize::from((budget.sum - duration).abs() > frame_secs);
        budget
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.accepted += other.accepted;
        for (reason, secs) in &other.rejected {
            *self.rejected.entry(reason.clone()).or_default() += secs;
        }
        self.failed += other.failed;
        self.waiting += other.waiting;
        self.duration += other.duration;
        self.n_unknown += other.n_unknown;
        self.n_mismatched += other.n_mismatched;
        self.sum = self.total();
    }

    pub fn rejected_secs(&self) -> f64 {
        self.rejected.values().sum::<f64>() + 0.0
    }

    fn total(&self) -> f64 {
        self.accepted + self.rejected_secs() + self.failed + self.waiting
    }
}

fn serialize_is_zero<S: Serializer>(n_mismatched: &usize, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_bool(*n_mismatched == 0)
}

/// Duration from the container header, in seconds, for a file that the extract stage has not processed.
fn probed_duration(source: &Path) -> Option<f64> {
    let secs = probe(source).ok()?.duration_secs?;
    (secs.is_finite() && secs > 0.0).then_some(secs)
}
