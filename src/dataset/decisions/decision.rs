//! A decision of a user about a range of a video. Its times are on the clock of the ledger: 0 is the start of frame 0.

use anyhow::{Result, ensure};
use orator_base::stage::Unit;
use orator_base::types::time::FrameRate;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::ops::Range;

/// Longest author and word, characters.
pub const MAX_CHARS: usize = 80;
/// Latest end of a range, seconds.
const MAX_SECS: f64 = 1e9;
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
    /// Follows the person at pixel `x`, `y` of the first frame, as players show it, until the range or the shot ends.
    Speaker,
    /// Replaces the words whose midpoints are in the range by `text`; without such words, adds it.
    Word,
}

/// An entry of `decisions.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Decision {
    /// 8 hex digits, unique in the file; assigned by `add`.
    pub id: String,
    pub speaker: String,
    /// Work name of the video (`Unit::video`).
    pub video: String,
    pub action: DecisionAction,
    /// Start of the range, seconds.
    pub start_secs: f64,
    /// End of the range, seconds, after its start.
    pub end_secs: f64,
    /// Pixel of the full picture as players show the file; only for `Speaker`.
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
    pub time: String,
}

impl Decision {
    /// Checks the decision; `id` and `time` only if they are not empty, as they are before `add`.
    ///
    /// # Errors
    /// The first invalid key, with what was expected.
    pub fn check(&self) -> Result<()> {
        let Self { start_secs, end_secs, action, x, y, text, .. } = self;
        let is_short = |text: &str| text.chars().count() <= MAX_CHARS && !text.contains(char::is_control);
        let is_word = |text: &String| is_short(text) && !text.contains(char::is_whitespace);
        let matches = |text: &str, pattern: &[u8], class: fn(&u8) -> bool| {
            let is_allowed = |(c, p): (u8, &u8)| if *p == b'0' { class(&c) } else { c == *p };
            text.is_empty() || (text.len() == pattern.len() && text.bytes().zip(pattern).all(is_allowed))
        };
        let (is_speaker, is_on_word) = (*action == DecisionAction::Speaker, *action == DecisionAction::Word);
        ensure!(!self.speaker.is_empty(), "`speaker` is empty: expected a speaker of the configuration");
        ensure!(!self.video.is_empty(), "`video` is empty: expected the name of a video in the work folder");
        ensure!(
            *start_secs >= 0.0 && end_secs > start_secs && *end_secs <= MAX_SECS,
            "invalid range {start_secs} to {end_secs} s: expected 0 <= start_secs < end_secs <= {MAX_SECS}"
        );
        ensure!(
            [x, y].iter().all(|px| px.map_or(!is_speaker, |px| is_speaker && (0.0..=1e6).contains(&px))),
            "invalid `x` and `y`: expected a pixel for the action speaker, and nothing for other actions"
        );
        ensure!(
            text.as_ref().map_or(!is_on_word, |text| is_on_word && is_word(text)),
            "invalid `text`: expected a word of at most {MAX_CHARS} characters, or \"\" to remove words, for the action \
             word, and nothing for other actions"
        );
        ensure!(is_short(&self.author), "invalid `author`: expected at most {MAX_CHARS} characters on one line");
        let is_hex = |c: &u8| matches!(c, b'0'..=b'9' | b'a'..=b'f');
        ensure!(matches(&self.id, b"00000000", is_hex), "invalid `id`: expected 8 hex digits, such as 1a2b3c4d");
        ensure!(
            matches(&self.time, b"0000-00-00T00:00:00Z", u8::is_ascii_digit),
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
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for one in decisions {
        let author = if one.author.is_empty() { String::new() } else { format!(" ({})", one.author) };
        let action = json!(one.action);
        *counts.entry(action.as_str().unwrap_or_default().to_owned() + &author).or_default() += 1;
    }
    counts.into_iter().map(|(what, n)| format!("{n} {what}")).collect::<Vec<_>>().join(", ")
}
