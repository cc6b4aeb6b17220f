//! Hypotheses that are fixed before the first participant.

use serde::{Deserialize, Serialize};

/// Hypothesis about one task.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyHypothesis {
    pub task: String,
    pub kind: HypothesisKind,
    /// The two conditions that it is about; every pair that the task compares where it is empty.
    #[serde(default)]
    pub conditions: Vec<String>,
    /// Whether each speaker is tested by itself instead of all together.
    #[serde(default)]
    pub per_speaker: bool,
    /// Bound of equivalence in percentage points on either side of chance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points: Option<f64>,
}

/// What a hypothesis claims.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HypothesisKind {
    /// The share of right responses is not 50 %.
    DiffersFromChance,
    /// The share of right responses is above 50 %.
    GreaterThanChance,
    /// The share of right responses lies within `points` of 50 %.
    Equivalence,
    /// Two conditions are rated, preferred or taken for real unequally.
    Differs,
}
