//! The ledger of a video's seconds: every second is either retained, refused (with a reason and a measured value), or
//! belongs to a stage that failed. `segment` writes it and `lift` moves seconds from retained to refused; later stages
//! only sum them.

use super::refusal::{FrameRefusal, Refusal};
use crate::input;
use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Ledger of a video; its intervals are contiguous and cover 0 to `duration_secs`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    pub duration_secs: f64,
    pub kept: Vec<Kept>,
    /// Parts of the retained intervals in which the hands rest on each other.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub resting: Vec<Kept>,
    pub refused: Vec<Refused>,
    #[serde(default)]
    pub failed: Vec<Failed>,
    /// Account of the words; `None`: no transcript was requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub words: Option<TranscriptReport>,
}

/// Account of a video's transcript.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TranscriptReport {
    /// File name of the transcript; `None`: the video has no transcript.
    pub file: Option<String>,
    #[serde(flatten)]
    pub count: WordCount,
    /// Problems of the transcript, one sentence each.
    pub notes: Vec<String>,
}

/// Numbers of words by outcome: `n_kept`, `n_refused` and `n_outside` add up to `n_words`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct WordCount {
    pub n_words: usize,
    /// Words inside samples.
    pub n_kept: usize,
    /// Words in intervals that were refused.
    pub n_refused: usize,
    /// Words after the end of the audio.
    pub n_outside: usize,
}

impl WordCount {
    /// Returns whether every word is accounted for.
    pub fn is_whole(&self) -> bool {
        self.n_kept + self.n_refused + self.n_outside == self.n_words
    }
}

impl std::ops::AddAssign for WordCount {
    fn add_assign(&mut self, other: Self) {
        self.n_words += other.n_words;
        self.n_kept += other.n_kept;
        self.n_refused += other.n_refused;
        self.n_outside += other.n_outside;
    }
}

/// A retained interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Kept {
    pub start_secs: f64,
    pub end_secs: f64,
}

/// A refused interval.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Refused {
    pub start_secs: f64,
    pub end_secs: f64,
    /// Short machine-readable reason.
    pub reason: String,
    /// Measured value; it and the violated limit `threshold` are in `unit`.
    pub measured: f64,
    pub threshold: f64,
    #[serde(default)]
    pub unit: String,
    /// Sentence for the user.
    #[serde(rename = "says")]
    pub message: String,
}

impl Refused {
    /// Creates an interval refused for `why`, with the standard message of its reason.
    pub fn new(start_secs: f64, end_secs: f64, why: FrameRefusal) -> Self {
        let message = why.refusal.message(why.measured, why.threshold);
        Self::with_message(start_secs, end_secs, why, message)
    }

    /// Creates an interval refused for `why`, with a custom message.
    pub fn with_message(start_secs: f64, end_secs: f64, why: FrameRefusal, message: String) -> Self {
        let FrameRefusal { refusal, measured, threshold } = why;
        let (reason, unit) = (refusal.reason().to_owned(), refusal.unit().to_owned());
        Self { start_secs, end_secs, reason, measured, threshold, unit, message }
    }
}

/// An interval that was not judged, because its stage failed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Failed {
    pub start_secs: f64,
    pub end_secs: f64,
    pub stage: String,
    pub error: String,
}

impl Ledger {
    /// Creates the ledger of a video whose stage failed: all of its `duration_secs` are `failed`.
    pub fn failed(duration_secs: f64, stage: &str, error: &str) -> Self {
        let failed = Failed { start_secs: 0.0, end_secs: duration_secs, stage: stage.into(), error: error.into() };
        Self { duration_secs, failed: vec![failed], ..Self::default() }
    }

    /// Reads `ledger.json`.
    ///
    /// # Errors
    /// The file cannot be read or is not a ledger; its intervals are not contiguous or do not fill the duration.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = input::read(path, input::MAX_TEXT).with_context(|| format!("cannot read {}", path.display()))?;
        let ledger: Self =
            serde_json::from_slice(&bytes).with_context(|| format!("{} is not a ledger", path.display()))?;
        ensure!(
            ledger.is_whole(),
            "{}: expected adjacent intervals from 0 to {:.2} s, without gaps or overlaps",
            path.display(),
            ledger.duration_secs
        );
        Ok(ledger)
    }

    /// Retained seconds.
    pub fn kept_secs(&self) -> f64 {
        self.kept.iter().map(|kept| kept.end_secs - kept.start_secs).sum()
    }

    /// Retained seconds in which the hands rest.
    pub fn resting_secs(&self) -> f64 {
        self.resting.iter().map(|rest| rest.end_secs - rest.start_secs).sum()
    }

    /// Sets the intervals in which the hands rest, given as (start, end) in seconds and clipped to the duration,
    /// because the video's last frame may extend beyond it.
    #[must_use]
    pub fn with_resting(mut self, stretches: impl Iterator<Item = (f64, f64)>) -> Self {
        let until = self.duration_secs;
        let kept = |(start, end): (f64, f64)| Kept { start_secs: start.min(until), end_secs: end.min(until) };
        self.resting = stretches.map(kept).filter(|rest| rest.start_secs < rest.end_secs).collect();
        self
    }

    /// Refused seconds by reason.
    pub fn refused_secs(&self) -> BTreeMap<String, f64> {
        let mut secs = BTreeMap::new();
        for refused in &self.refused {
            *secs.entry(refused.reason.clone()).or_default() += refused.end_secs - refused.start_secs;
        }
        secs
    }

    /// Seconds of stages that failed.
    pub fn failed_secs(&self) -> f64 {
        self.failed.iter().map(|failed| failed.end_secs - failed.start_secs).sum()
    }

    /// Returns whether every second from 0 to the end belongs to exactly one interval.
    pub fn is_whole(&self) -> bool {
        let kept = self.kept.iter().map(|kept| (kept.start_secs, kept.end_secs));
        let refused = self.refused.iter().map(|refused| (refused.start_secs, refused.end_secs));
        let failed = self.failed.iter().map(|failed| (failed.start_secs, failed.end_secs));
        let mut stretches: Vec<_> = kept.chain(refused).chain(failed).collect();
        stretches.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut at = 0.0;
        for (start, end) in stretches {
            if start != at || end <= start {
                return false;
            }
            at = end;
        }
        at == self.duration_secs
    }
}

/// Formats `label 3.2 s, label 1.0 s`, longest first; reasons below 0.05 s are omitted.
pub fn longest_first(secs: &BTreeMap<String, f64>) -> String {
    let mut reasons: Vec<_> = secs.iter().filter(|(_, secs)| **secs >= 0.05).collect();
    reasons.sort_by(|a, b| b.1.total_cmp(a.1).then(a.0.cmp(b.0)));
    reasons
        .iter()
        .map(|(reason, secs)| format!("{} {secs:.1} s", Refusal::label(reason)))
        .collect::<Vec<_>>()
        .join(", ")
}
