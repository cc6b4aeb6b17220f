//! What a participant answers in a trial, and the record of one answered trial, which `serve` exports and the analysis reads.

use super::plan::{TaskDesign, TrialPhase};
use serde::{Deserialize, Serialize};

/// Film of a pair.
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
    /// Turing test and mismatch: the chosen film.
    Side(ScreenSide),
    /// Turing test of one film: whether it was taken for real.
    Real(bool),
    /// Preference from -2, the left film clearly, to 2, the right film clearly.
    Step(i8),
    /// Sliders: one score from 0 to 100 for each film, from left to right.
    Scores(Vec<u8>),
    /// Attention check: the number seen, 10 to 99.
    Number(u16),
}

/// Columns of a table of votes: the fields of [`StudyVote`] in their order.
pub const VOTE_COLUMNS: [&str; 15] = [
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
    "completed",
];

/// One answered trial with all that the analysis needs: a row of `orator study export`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyVote {
    /// Random name of the participant.
    pub participant: String,
    pub task: String,
    pub design: TaskDesign,
    pub phase: TrialPhase,
    /// Place in the session, from 1.
    pub trial: u32,
    pub clip: String,
    pub speaker: String,
    /// Conditions of the films from left to right.
    pub conditions: Vec<String>,
    pub response: Response,
    /// Right response, where there is one: the real film's, the matched film's, the shown number.
    pub expected: Option<Response>,
    /// Seconds in which a film had stopped for want of data.
    pub stalled_secs: f64,
    /// Seconds in which the page was not in front.
    pub unfocused_secs: f64,
    /// Seconds from the end of the films to the answer.
    pub response_secs: f64,
    /// How often the films were played.
    pub plays: u32,
    /// Whether the participant completed the session.
    pub completed: bool,
}

#[cfg(test)]
impl StudyVote {
    /// Vote of the main phase for tests.
    pub fn example(design: TaskDesign, conditions: &[&str], response: Response) -> Self {
        Self {
            participant: "p".to_owned(),
            task: "t".to_owned(),
            design,
            phase: TrialPhase::Main,
            trial: 3,
            clip: "ellen/4".to_owned(),
            speaker: "ellen".to_owned(),
            conditions: conditions.iter().map(|name| (*name).to_owned()).collect(),
            response,
            expected: None,
            stalled_secs: 0.5,
            unfocused_secs: 0.0,
            response_secs: 4.25,
            plays: 2,
            completed: true,
        }
    }
}
