//! The account of seconds: of every video what was kept, refused for which reason, lost to a failed stage or is not
//! judged yet, and whether that adds up to its duration.

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

/// A frame at the lowest usual dataset rate: an account that is off by more does not add up.
const UNKNOWN_FRAME_SECS: f64 = 1.0 / 15.0;

/// How far a video has come.
#[derive(Clone, Copy)]
pub(super) enum Standing<'a> {
    /// Every stage up to `lift` is done: its ledger counts.
    Judged,
    /// A stage failed, with its error.
    Failed { stage: StageName, error: &'a str },
    /// A stage has not run.
    Waiting,
}

/// Seconds of a video, or of several together.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TimeAccount {
    /// `speaker/video`, or the speaker.
    pub of: String,
    /// In intervals worth keeping.
    #[serde(rename = "kept_secs")]
    pub kept: f64,
    /// Refused, by reason.
    #[serde(rename = "refused_secs")]
    pub refused: BTreeMap<String, f64>,
    /// Lost to a stage that failed.
    #[serde(rename = "failed_secs")]
    pub failed: f64,
    /// Of videos that are not judged yet.
    #[serde(rename = "waiting_secs")]
    pub waiting: f64,
    /// Of the videos whose length is known.
    #[serde(rename = "duration_secs")]
    pub duration: f64,
    /// Kept, refused, failed and waiting together.
    #[serde(rename = "sum_secs")]
    pub sum: f64,
    /// Videos whose length is not known: they failed before it was.
    #[serde(rename = "unknown_durations")]
    pub n_unknown: usize,
    /// Videos whose seconds do not add up to their duration, to one frame.
    #[serde(rename = "adds_up", serialize_with = "is_none")]
    pub n_wrong: usize,
    /// Sentence about what is not judged of a video without pictures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_judged: Option<String>,
    /// How much later the sound of a video is than its picture, where that is sure and to be seen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sound_offset: Option<SoundOffset>,
    /// Whether it is of one video or of a speaker.
    pub kind: AccountKind,
}

/// What an account is of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum AccountKind {
    /// One video.
    Video,
    /// All videos of a speaker, or of several.
    #[default]
    Speaker,
}

impl TimeAccount {
    /// Nothing yet of a speaker's videos.
    pub(super) fn of_speaker(speaker: &str) -> Self {
        Self { of: speaker.to_owned(), ..Self::default() }
    }

    /// One video whose stages wrote under `work`; `is_extracted`: the extract stage is fresh.
    pub(super) fn of_video(work: &Path, unit: &Unit, standing: Standing, is_extracted: bool) -> Self {
        let account = Self { of: unit.to_string(), kind: AccountKind::Video, ..Self::default() };
        let media = if is_extracted { MediaInfo::read(&Artifact::MediaInfo.path(work, unit)).ok() } else { None };
        let not_judged = media.as_ref().and_then(MediaInfo::not_judged);
        let offset = sound_offset_json::read(&Artifact::SoundOffset.path(work, unit)).ok().flatten();
        let account = Self { not_judged, sound_offset: offset.filter(SoundOffset::is_reportable), ..account };
        let Some(duration) = media.as_ref().map(|media| media.duration_secs).or_else(|| probed(&unit.source)) else {
            return Self { n_unknown: 1, ..account };
        };
        let (ledger, waiting) = match standing {
            Standing::Judged => (Ledger::read(&Artifact::LiftLedger.path(work, unit)), 0.0),
            Standing::Failed { stage, error } => (Ok(Ledger::failed(duration, stage.as_str(), error)), 0.0),
            Standing::Waiting => (Ok(Ledger::default()), duration),
        };
        let unread = |error| Ledger::failed(duration, StageName::Lift.as_str(), &format!("{error:#}"));
        let ledger = ledger.unwrap_or_else(unread);
        // an empty sum is -0
        let (kept, refused, failed) = (ledger.kept_secs() + 0.0, ledger.refused_secs(), ledger.failed_secs() + 0.0);
        let mut account = Self { kept, refused, failed, waiting, duration, ..account };
        account.sum = account.added();
        let frame_secs = media.as_ref().map_or(UNKNOWN_FRAME_SECS, |media| 1.0 / media.fps.per_sec());
        account.n_wrong = usize::from((account.sum - duration).abs() > frame_secs);
        account
    }

    /// Adds another account.
    pub(super) fn add(&mut self, other: &Self) {
        self.kept += other.kept;
        for (reason, secs) in &other.refused {
            *self.refused.entry(reason.clone()).or_default() += secs;
        }
        self.failed += other.failed;
        self.waiting += other.waiting;
        self.duration += other.duration;
        self.n_unknown += other.n_unknown;
        self.n_wrong += other.n_wrong;
        self.sum = self.added();
    }

    /// Seconds refused for any reason.
    pub fn refused_secs(&self) -> f64 {
        self.refused.values().sum::<f64>() + 0.0
    }

    fn added(&self) -> f64 {
        self.kept + self.refused_secs() + self.failed + self.waiting
    }
}

fn is_none<S: Serializer>(n_wrong: &usize, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_bool(*n_wrong == 0)
}

/// Seconds of a file that no stage could take in, as its container states them.
fn probed(source: &Path) -> Option<f64> {
    let secs = probe(source).ok()?.duration_secs?;
    (secs.is_finite() && secs > 0.0).then_some(secs)
}
