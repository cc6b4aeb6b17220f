//! Response of a participant to a trial, the record of one answered trial that `serve` exports and the analysis reads.

use super::plan::{TaskDesign, TrialPhase};
use serde::{Deserialize, Serialize};

/// Position of a film on the screen, or of an avatar in a side-by-side film.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ScreenSide {
    Left,
    Right,
}

/// Answer to one trial, `{"side": "left"}` in JSON.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Response {
    /// Turing test and mismatch: the chosen film or avatar.
    Side(ScreenSide),
    /// Turing test with a single film: whether it was judged real.
    Real(bool),
    /// Preference: -2 for the left film clearly to 2 for the right film clearly.
    Step(i8),
    /// Sliders: one score from 0 to 100 for each film, left to right.
    Scores(Vec<u8>),
    /// Attention check: the number that the participant read, 10 to 99.
    Number(u16),
}

/// Columns of a table of votes: the fields of [`StudyVote`] in declaration order.
pub const VOTE_COLUMNS: [&str; 16] = [
    "participant",
    "task",
    "design",
    "phase",
    "trial",
    "clip",
    "speaker",
    "conditions",
    "response",
    "expected",
    "stalled_secs",
    "unfocused_secs",
    "response_secs",
    "plays",
    "reloads",
    "completed",
];

/// One answered trial with all data that the analysis needs; one row of `orator study export`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyVote {
    /// Random identifier of the participant.
    pub participant: String,
    pub task: String,
    pub design: TaskDesign,
    pub phase: TrialPhase,
    /// Position in the session, from 1.
    pub trial: u32,
    pub clip: String,
    pub speaker: String,
    /// Conditions of the avatars, left to right.
    pub conditions: Vec<String>,
    pub response: Response,
    /// Correct response, if the task has one: the side of the real or the matched film, whether a single film is real,
    /// or the number of an attention check.
    pub expected: Option<Response>,
    /// Seconds during which playback was stalled for lack of data.
    pub stalled_secs: f64,
    /// Seconds during which the page was hidden or unfocused.
    pub unfocused_secs: f64,
    /// Seconds from the end of the films to the answer.
    pub response_secs: f64,
    /// Number of times the films were played.
    pub plays: u32,
    /// Number of times the page was reloaded after a film of the trial began to play.
    #[serde(default)]
    pub reloads: u32,
    /// Whether the participant completed the session.
    pub completed: bool,
}
