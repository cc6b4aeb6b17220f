//! The ledger of a video's seconds: every second is accepted, rejected (with a reason and a measured value), or is of a
//! failed stage. `segment` writes it and `lift` moves seconds from accepted to rejected; later stages only sum them.

use super::rejection::{FrameRejection, Rejection};
use crate::input;
use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Ledger of a video; its intervals are contiguous and cover 0 to `duration_secs`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    pub duration_secs: f64,
    #[serde(rename = "kept")]
    pub accepted: Vec<AcceptedInterval>,
    /// Parts of the accepted intervals in which the hands rest on each other.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub resting: Vec<AcceptedInterval>,
    #[serde(rename = "refused")]
    pub rejected: Vec<RejectedInterval>,
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

/// Numbers of words by outcome: `n_accepted`, `n_rejected` and `n_outside` add up to `n_words`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct WordCount {
    pub n_words: usize,
    /// Words inside samples.
    #[serde(rename = "n_kept")]
    pub n_accepted: usize,
    /// Words in intervals that were rejected.
    #[serde(rename = "n_refused")]
    pub n_rejected: usize,
    /// Words after the end of the audio.
    pub n_outside: usize,
}

impl WordCount {
    /// Returns whether every word is accounted for.
    pub fn is_complete(&self) -> bool {
        self.n_accepted + self.n_rejected + self.n_outside == self.n_words
    }
}

impl std::ops::AddAssign for WordCount {
    fn add_assign(&mut self, other: Self) {
        self.n_words += other.n_words;
        self.n_accepted += other.n_accepted;
        self.n_rejected += other.n_rejected;
        self.n_outside += other.n_outside;
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AcceptedInterval {
    pub start_secs: f64,
    pub end_secs: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RejectedInterval {
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

impl RejectedInterval {
    /// Creates an interval rejected for `why`, with the standard message of its reason.
    pub fn new(start_secs: f64, end_secs: f64, why: FrameRejection) -> Self {
        let message = why.rejection.message(why.measured, why.threshold);
        Self::with_message(start_secs, end_secs, why, message)
    }

    /// Creates an interval rejected for `why`, with a custom message.
    pub fn with_message(start_secs: f64, end_secs: f64, why: FrameRejection, message: String) -> Self {
        let FrameRejection { rejection, measured, threshold } = why;
        let (reason, unit) = (rejection.reason().to_owned(), rejection.unit().to_owned());
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
            ledger.is_complete(),
            "{}: expected adjacent intervals from 0 to {:.2} s, without gaps or overlaps",
            path.display(),
            ledger.duration_secs
        );
        Ok(ledger)
    }

    pub fn accepted_secs(&self) -> f64 {
        self.accepted.iter().map(|accepted| accepted.end_secs - accepted.start_secs).sum()
    }

    /// Accepted seconds in which the hands rest.
    pub fn resting_secs(&self) -> f64 {
        self.resting.iter().map(|rest| rest.end_secs - rest.start_secs).sum()
    }

    /// Sets the intervals in which the hands rest, given as (start, end) in seconds and clipped to the duration,
    /// because the video's last frame may extend beyond it.
    #[must_use]
    pub fn with_resting(mut self, stretches: impl Iterator<Item = (f64, f64)>) -> Self {
        let until = self.duration_secs;
        let accepted =
            |(start, end): (f64, f64)| AcceptedInterval { start_secs: start.min(until), end_secs: end.min(until) };
        self.resting = stretches.map(accepted).filter(|rest| rest.start_secs < rest.end_secs).collect();
        self
    }

    pub fn rejected_secs(&self) -> BTreeMap<String, f64> {
        let mut secs = BTreeMap::new();
        for rejected in &self.rejected {
            *secs.entry(rejected.reason.clone()).or_default() += rejected.end_secs - rejected.start_secs;
        }
        secs
    }

    pub fn failed_secs(&self) -> f64 {
        self.failed.iter().map(|failed| failed.end_secs - failed.start_secs).sum()
    }

    /// Returns whether every second from 0 to the end belongs to exactly one interval.
    pub fn is_complete(&self) -> bool {
        let accepted = self.accepted.iter().map(|accepted| (accepted.start_secs, accepted.end_secs));
        let rejected = self.rejected.iter().map(|rejected| (rejected.start_secs, rejected.end_secs));
        let failed = self.failed.iter().map(|failed| (failed.start_secs, failed.end_secs));
        let mut stretches: Vec<_> = accepted.chain(rejected).chain(failed).collect();
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
        .map(|(reason, secs)| format!("{} {secs:.1} s", Rejection::label(reason)))
        .collect::<Vec<_>>()
        .join(", ")
}
