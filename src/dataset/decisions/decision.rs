//! A decision of a user about a range of a video. Its times are on the clock of the ledger: 0 is the start of frame 0.

use anyhow::{Context, Result, ensure};
use orator_base::stage::Unit;
use orator_base::types::time::FrameRate;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;

/// Longest author and word, characters.
const MAX_CHARS: usize = 80;
/// Share of a frame that a range may overlap without affecting the frame, so that rounded times are harmless.
const ROUNDING_FRAMES: f64 = 0.05;

/// What a decision does with its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DecisionAction {
    /// Accepts the frames in which a person is detected; shot boundaries still divide intervals.
    Accept,
    /// Rejects the frames.
    Reject,
    /// Exchanges the keypoints of the left and the right hand.
    SwapHands,
    /// Follows the person at pixel `x`, `y` of the first frame, until the range or the shot ends.
    Speaker,
    /// Replaces the words whose midpoints are in the range by `text`; without such words, adds it.
    Word,
}

/// An entry of `decisions.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Decision {
    /// 8 hex digits, unique in the file; assigned by `add`.
    #[serde(default)]
    pub id: String,
    pub speaker: String,
    /// Work name of the video (`Unit::video`).
    pub video: String,
    pub action: DecisionAction,
    /// Start of the range, seconds.
    pub start_secs: f64,
    /// End of the range, seconds, after its start.
    pub end_secs: f64,
    /// Pixel of the full picture; only for `Speaker`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub x: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub y: Option<f64>,
    /// One word, or empty to remove the words; only for `Word`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
    /// Name of the user, at most 80 characters; may be empty.
    #[serde(default)]
    pub author: String,
    /// RFC 3339 time in UTC, `2026-11-28T15:20:00Z`; assigned by `add`.
    #[serde(default)]
    pub time: String,
}

impl fmt::Display for DecisionAction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Accept => "accept",
            Self::Reject => "reject",
            Self::SwapHands => "swap-hands",
            Self::Speaker => "speaker",
            Self::Word => "word",
        })
    }
}

impl Decision {
    /// Checks everything but `id` and `time`.
    ///
    /// # Errors
    /// The first invalid key, with what was expected.
    pub fn check(&self) -> Result<()> {
        let Self { start_secs: start, end_secs: end, .. } = *self;
        ensure!(!self.speaker.is_empty(), "`speaker` is empty: expected a speaker of the configuration");
        ensure!(!self.video.is_empty(), "`video` is empty: expected the name of a video in the work folder");
        ensure!(
            start.is_finite() && end.is_finite() && start >= 0.0 && end > start,
            "invalid range {start} to {end} s: expected 0 <= start_secs < end_secs"
        );
        let is_speaker = self.action == DecisionAction::Speaker;
        for (key, px) in [("x", self.x), ("y", self.y)] {
            ensure!(is_speaker == px.is_some(), "`{key}`: expected for `speaker`, and for no other action");
            ensure!(px.is_none_or(|px| (0.0..=1e6).contains(&px)), "invalid `{key}`: expected 0 to 1000000 px");
        }
        let is_word = self.action == DecisionAction::Word;
        ensure!(is_word == self.text.is_some(), "`text`: expected for `word`, and for no other action");
        let is_invalid = |c: char| c.is_whitespace() || c.is_control();
        let is_short = |text: &str| text.chars().count() <= MAX_CHARS;
        ensure!(
            self.text.as_deref().is_none_or(|text| !text.contains(is_invalid) && is_short(text)),
            "invalid `text`: expected one word of at most {MAX_CHARS} characters, or an empty text to remove words"
        );
        ensure!(
            !self.author.contains(char::is_control) && is_short(&self.author),
            "invalid `author`: expected at most {MAX_CHARS} characters on one line"
        );
        Ok(())
    }

    /// Checks `id` and `time`, which `add` assigns.
    ///
    /// # Errors
    /// The invalid key, with what was expected.
    pub(super) fn check_assigned(&self) -> Result<()> {
        let is_hex = |c: u8| c.is_ascii_digit() || (b'a'..=b'f').contains(&c);
        ensure!(
            self.id.len() == 8 && self.id.bytes().all(is_hex),
            "invalid `id`: expected 8 hex digits, such as 1a2b3c4d"
        );
        let is_time = |(c, pattern): (u8, u8)| if pattern == b'0' { c.is_ascii_digit() } else { c == pattern };
        let pattern = b"0000-00-00T00:00:00Z";
        ensure!(
            self.time.len() == pattern.len() && self.time.bytes().zip(*pattern).all(is_time),
            "invalid `time`: expected UTC, such as \"2026-11-28T15:20:00Z\""
        );
        Ok(())
    }

    /// Frames that the range overlaps, of `n_frames`.
    pub fn frames(&self, fps: FrameRate, n_frames: usize) -> Range<usize> {
        let [start, end] = [self.start_secs, self.end_secs].map(|secs| secs * fps.per_sec());
        let start = (start + ROUNDING_FRAMES).floor() as usize;
        // A range that is shorter than the tolerance affects the frame in which it starts.
        let end = ((end - ROUNDING_FRAMES).ceil() as usize).max(start + 1).min(n_frames);
        start.min(end)..end
    }

    /// Whether the range contains a time.
    pub fn contains(&self, secs: f64) -> bool {
        (self.start_secs..self.end_secs).contains(&secs)
    }
}

/// Decisions about a unit with one of the `actions`, in the order of the file, in which later ones take precedence.
pub fn of_unit<'a>(all: &'a [Decision], unit: &Unit, actions: &[DecisionAction]) -> Vec<&'a Decision> {
    let concerns = |one: &&Decision| one.speaker == unit.speaker && one.video == unit.video;
    all.iter().filter(concerns).filter(|one| actions.contains(&one.action)).collect()
}

/// Adds decisions to the settings of a stage. Without any, the settings are those of a version without decisions, so
/// that its outputs stay up to date. Identity and time of a decision do not influence the output.
pub fn record(decisions: &[&Decision], settings: &mut Value) {
    let content = |one: &&Decision| {
        let Decision { action, start_secs, end_secs, x, y, text, author, .. } = one;
        json!([one.video, action, start_secs, end_secs, x, y, text, author])
    };
    if let (false, Some(settings)) = (decisions.is_empty(), settings.as_object_mut()) {
        settings.insert("decisions".to_owned(), decisions.iter().map(content).collect());
    }
}

/// Numbers of decisions by action and author: `2 accept (ana), 1 word`.
pub fn counts(decisions: &[&Decision]) -> String {
    let mut counts: BTreeMap<(DecisionAction, &str), usize> = BTreeMap::new();
    for one in decisions {
        *counts.entry((one.action, &one.author)).or_default() += 1;
    }
    let text = |((action, author), n): ((DecisionAction, &str), usize)| match author {
        "" => format!("{n} {action}"),
        author => format!("{n} {action} ({author})"),
    };
    counts.into_iter().map(text).collect::<Vec<_>>().join(", ")
}

/// Parses an entry of the file.
///
/// # Errors
/// An unknown or missing key, or an invalid value.
pub(super) fn parse(entry: toml::Value) -> Result<Decision> {
    let decision: Decision = entry.try_into().context("expected the keys of a decision")?;
    decision.check_assigned()?;
    decision.check()?;
    Ok(decision)
}
