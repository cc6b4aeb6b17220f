//! The account of a video's seconds: every one of them is kept, refused for a reason with what was measured, or lost to a
//! stage that failed. `segment` writes it, `lift` moves seconds from kept to refused; later stages only add up.

use super::refusal::FrameRefusal;
use crate::input;
use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The whole account; its stretches lie end to end from 0 to `duration_secs`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    pub duration_secs: f64,
    pub kept: Vec<Kept>,
    /// Parts of the kept stretches in which the hands rest on each other.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub resting: Vec<Kept>,
    pub refused: Vec<Refused>,
    #[serde(default)]
    pub failed: Vec<Failed>,
    /// Its words; `None`: no transcript was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub words: Option<TranscriptAccount>,
}

/// The account of a video's words.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TranscriptAccount {
    /// File name of the transcript; `None`: the video has none.
    pub file: Option<String>,
    #[serde(flatten)]
    pub count: WordCount,
    /// What is doubtful or wrong about it, a sentence each.
    pub notes: Vec<String>,
}

/// What became of words: `n_kept`, `n_refused` and `n_outside` add up to `n_words`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct WordCount {
    pub n_words: usize,
    /// Words in samples.
    pub n_kept: usize,
    /// Words in stretches that were not kept.
    pub n_refused: usize,
    /// Words after the end of the sound.
    pub n_outside: usize,
}

impl WordCount {
    /// Whether every word is accounted for.
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

/// A stretch worth keeping.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Kept {
    pub start_secs: f64,
    pub end_secs: f64,
}

/// A stretch that was not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Refused {
    pub start_secs: f64,
    pub end_secs: f64,
    /// The reason in a word or two, for programs.
    pub reason: String,
    /// What was measured, and what it had to reach or stay below, both in `unit`.
    pub measured: f64,
    pub threshold: f64,
    #[serde(default)]
    pub unit: String,
    /// A sentence for people.
    #[serde(rename = "says")]
    pub message: String,
}

impl Refused {
    /// A stretch refused for `why`, in the words of its reason.
    pub fn new(start_secs: f64, end_secs: f64, why: FrameRefusal) -> Self {
        let message = why.refusal.message(why.measured, why.threshold);
        Self::with_message(start_secs, end_secs, why, message)
    }

    /// A stretch refused for `why`, in words of its own.
    pub fn with_message(start_secs: f64, end_secs: f64, why: FrameRefusal, message: String) -> Self {
        let FrameRefusal { refusal, measured, threshold } = why;
        let (reason, unit) = (refusal.reason().to_owned(), refusal.unit().to_owned());
        Self { start_secs, end_secs, reason, measured, threshold, unit, message }
    }
}

/// A stretch that no verdict was reached on: its stage failed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Failed {
    pub start_secs: f64,
    pub end_secs: f64,
    pub stage: String,
    pub error: String,
}

impl Ledger {
    /// The account of a video whose stage failed: all of its `duration_secs`.
    pub fn failed(duration_secs: f64, stage: &str, error: &str) -> Self {
        let failed = Failed { start_secs: 0.0, end_secs: duration_secs, stage: stage.into(), error: error.into() };
        Self { duration_secs, failed: vec![failed], ..Self::default() }
    }

    /// Reads `ledger.json` and checks that the stretches lie end to end and fill the duration.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = input::read(path, input::MOST_TEXT).with_context(|| format!("cannot read {}", path.display()))?;
        let ledger: Self =
            serde_json::from_slice(&bytes).with_context(|| format!("{} is no ledger", path.display()))?;
        ensure!(
            ledger.is_whole(),
            "{}: its stretches do not fill {} s end to end",
            path.display(),
            ledger.duration_secs
        );
        Ok(ledger)
    }

    /// Seconds kept.
    pub fn kept_secs(&self) -> f64 {
        self.kept.iter().map(|kept| kept.end_secs - kept.start_secs).sum()
    }

    /// Seconds kept in which the hands rest.
    pub fn resting_secs(&self) -> f64 {
        self.resting.iter().map(|rest| rest.end_secs - rest.start_secs).sum()
    }

    /// With stretches in which the hands rest, from second to second; the video's last frame may be cut off by its end.
    #[must_use]
    pub fn with_resting(mut self, stretches: impl Iterator<Item = (f64, f64)>) -> Self {
        let until = self.duration_secs;
        let kept = |(start, end): (f64, f64)| Kept { start_secs: start.min(until), end_secs: end.min(until) };
        self.resting = stretches.map(kept).filter(|rest| rest.start_secs < rest.end_secs).collect();
        self
    }

    /// Seconds refused, by reason.
    pub fn refused_secs(&self) -> BTreeMap<String, f64> {
        let mut secs = BTreeMap::new();
        for refused in &self.refused {
            *secs.entry(refused.reason.clone()).or_default() += refused.end_secs - refused.start_secs;
        }
        secs
    }

    /// Seconds of failed stages.
    pub fn failed_secs(&self) -> f64 {
        self.failed.iter().map(|failed| failed.end_secs - failed.start_secs).sum()
    }

    /// Whether every second from 0 to the end belongs to exactly one stretch.
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

/// `reason 3.2 s, reason 1.0 s`, the longest first.
pub fn longest_first(secs: &BTreeMap<String, f64>) -> String {
    let mut reasons: Vec<_> = secs.iter().filter(|(_, secs)| **secs >= 0.05).collect();
    reasons.sort_by(|a, b| b.1.total_cmp(a.1).then(a.0.cmp(b.0)));
    reasons.iter().map(|(reason, secs)| format!("{reason} {secs:.1} s")).collect::<Vec<_>>().join(", ")
}
