//! What a participant answers in a trial.

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
