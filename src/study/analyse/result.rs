//! Result of an analysis, the source of the page and the summary. Every statistic states its
//! method, whether it was registered before the data were seen, and whether it treats votes as independent.

use super::exclusion::ExclusionSummary;
use super::statistic::{IntervalEstimate, StatisticOrigin, StatisticSet, TestResult};
use super::votes::read::RejectedRow;
use crate::file::AnalysisSettings;
use crate::plan::TaskDesign;
use serde::Serialize;

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StudyAnalysis {
    pub version: u32,
    pub title: String,
    /// File or folder name of the votes, without its path.
    pub source: String,
    /// Combined hash of the sealed study; `None` for votes without a sealed study.
    pub seal: Option<String>,
    pub settings: StatisticSettings,
    /// Rows of the source that are not valid votes.
    pub rejected: Vec<RejectedRow>,
    pub exclusions: ExclusionSummary,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub hypotheses: Vec<JudgedHypothesis>,
    pub tasks: Vec<TaskAnalysis>,
    pub without_exclusions: Vec<TaskAnalysis>,
    pub notes: Vec<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JudgedHypothesis {
    pub task: String,
    pub claim: String,
    /// Registered statistic.
    pub statistic: String,
    /// Outcomes by speaker, condition or pair; empty if the task has no votes.
    pub claims: Vec<JudgedClaim>,
}

/// Outcome of a hypothesis for one speaker, condition or pair.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JudgedClaim {
    pub scope: String,
    /// p value of the registered test, adjusted if it belongs to a family.
    pub p: Option<f64>,
    /// Whether the votes support the claim; `None` if the test could not be computed.
    pub holds: Option<bool>,
}

impl JudgedClaim {
    /// Outcome as text. A non-significant test shows nothing, so the opposite of a claim is never reported.
    pub fn outcome(&self) -> &'static str {
        match self.holds {
            Some(true) => "shown",
            Some(false) => "not shown",
            None => "not tested",
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StatisticSettings {
    /// Confidence level of the intervals.
    pub confidence: f64,
    /// Equivalence bound as a proportion: 0.1 is 10 percentage points.
    pub bound: f64,
    /// Number of bootstrap draws of participants; 0 skips them.
    pub n_draws: usize,
    pub seed: u64,
    pub with_models: bool,
}

impl StatisticSettings {
    /// Significance level of the tests on which conclusions are based.
    pub fn level(&self) -> f64 {
        1.0 - self.confidence
    }
}

impl From<&AnalysisSettings> for StatisticSettings {
    fn from(registered: &AnalysisSettings) -> Self {
        let AnalysisSettings { alpha, resamples, seed } = *registered;
        Self { confidence: 1.0 - alpha, n_draws: resamples, seed, ..Self::default() }
    }
}

impl Default for StatisticSettings {
    fn default() -> Self {
        Self { confidence: 0.95, bound: 0.1, n_draws: 10_000, seed: 1, with_models: true }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TaskAnalysis {
    pub task: String,
    pub design: TaskDesign,
    pub n_votes: usize,
    pub n_participants: usize,
    pub n_clips: usize,
    pub conditions: Vec<String>,
    pub speakers: Vec<String>,
    /// Sentences on what can be concluded and what cannot.
    pub conclusions: Vec<String>,
    /// Proportions: all votes first, then by speaker and by condition. Empty for preferences and sliders.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub shares: Vec<ShareAnalysis>,
    /// Proportions by clip, of the measure of the first of `shares`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub clips: Vec<ClipShare>,
    /// Scores by condition, highest median first. Sliders only.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub scores: Vec<ScoreAnalysis>,
    /// Pairs of conditions. Preferences, sliders and single films.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub pairs: Vec<PairAnalysis>,
    /// Test whether any condition differs from the others. Sliders only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub overall: Option<TestResult>,
    /// Strengths of the conditions, highest first. Preferences and sliders.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub strengths: Vec<StrengthEstimate>,
    /// Krippendorff's alpha of the participants: 1 for perfect agreement, 0 for chance.
    pub agreement: Option<f64>,
    /// Statistics that could not be computed, with reasons.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<String>,
}

/// Outcome whose proportion is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShareMeasure {
    /// Turing test: the generated film was chosen as the real one.
    GeneratedChosen,
    /// Mismatch: the film with the motion of its own speech was chosen.
    MatchedChosen,
    /// Turing test with a single film: the response was correct.
    Correct,
    /// Turing test with a single film: the film was judged real, correctly or not.
    JudgedReal,
}

impl ShareMeasure {
    pub fn name(self) -> &'static str {
        match self {
            Self::GeneratedChosen => "generated motion chosen",
            Self::MatchedChosen => "matching motion chosen",
            Self::Correct => "correct",
            Self::JudgedReal => "judged real",
        }
    }
}

/// Proportion of votes, compared with chance where chance is defined.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ShareAnalysis {
    pub measure: ShareMeasure,
    /// Speaker; `None` for all speakers.
    pub speaker: Option<String>,
    /// Condition; `None` for all conditions.
    pub condition: Option<String>,
    pub n_votes: u64,
    pub n_successes: u64,
    pub n_participants: usize,
    pub n_clips: usize,
    pub share: f64,
    /// Standard deviation of the participants' own proportions; `None` with fewer than two participants.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub participant_sd: Option<f64>,
    #[serde(flatten)]
    pub statistics: StatisticSet,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<ModelEstimate>,
    pub conclusion: TestOutcome,
}

impl ShareAnalysis {
    /// Proportion of correct responses: the real film found, the matched film chosen.
    pub fn right_share(&self) -> f64 {
        match self.measure {
            ShareMeasure::GeneratedChosen => 1.0 - self.share,
            ShareMeasure::MatchedChosen | ShareMeasure::Correct | ShareMeasure::JudgedReal => self.share,
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ClipShare {
    pub speaker: String,
    pub clip: String,
    pub n_votes: u64,
    pub n_successes: u64,
    pub share: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScoreAnalysis {
    pub condition: String,
    pub n_scores: usize,
    pub n_participants: usize,
    pub n_clips: usize,
    /// Minimum, 5 %, median, 95 % and maximum.
    pub quantiles: [f64; 5],
    pub median: f64,
    pub mean: f64,
    #[serde(flatten)]
    pub statistics: StatisticSet,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PairAnalysis {
    pub first: String,
    pub second: String,
    pub n_votes: usize,
    pub n_participants: usize,
    pub n_clips: usize,
    /// Numbers of votes for the first condition, undecided, and for the second; `None` if each vote judged only one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub orders: Option<[u64; 3]>,
    /// Preferences: number of votes per step, from clearly the second to clearly the first condition.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steps: Option<[u64; 5]>,
    /// Mean of the first less the second, in the unit of the scale.
    pub difference: f64,
    #[serde(flatten)]
    pub statistics: StatisticSet,
    pub conclusion: TestOutcome,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StrengthEstimate {
    pub condition: String,
    /// Log odds of being preferred to a condition of mean strength (Bradley and Terry 1952).
    pub log_strength: f64,
    pub interval: Option<IntervalEstimate>,
    /// Strength on the Elo scale, with mean 1000.
    pub elo: f64,
}

/// Mixed logistic regression of a proportion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelEstimate {
    pub exploratory: bool,
    /// Marginal proportion over all participants and clips.
    pub share: f64,
    /// Log odds of a participant and clip with effect 0.
    pub log_odds: f64,
    pub standard_error: f64,
    /// Standard deviations of the random intercepts of participants and clips, log odds.
    pub sd_participants: f64,
    pub sd_clips: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum TestOutcome {
    /// Above chance, or the first condition above the second.
    Above,
    Below,
    /// Significant difference, but within the equivalence bound.
    AboveWithinBound,
    BelowWithinBound,
    /// No significant difference, and equivalence within the bound is shown.
    Equivalent,
    /// Neither a difference nor equivalence is shown.
    Inconclusive,
    /// No test could be computed.
    Untested,
}

impl TestOutcome {
    /// Outcome of a two-sided p value at `level`, the sign of the difference and the equivalence test.
    pub fn new(p: Option<f64>, level: f64, difference: f64, is_equivalent: bool) -> Self {
        match (p, is_equivalent) {
            (None, _) => Self::Untested,
            (Some(p), true) if p < level && difference > 0.0 => Self::AboveWithinBound,
            (Some(p), true) if p < level => Self::BelowWithinBound,
            (Some(p), false) if p < level && difference > 0.0 => Self::Above,
            (Some(p), false) if p < level => Self::Below,
            (Some(_), true) => Self::Equivalent,
            (Some(_), false) => Self::Inconclusive,
        }
    }
}

impl TaskAnalysis {
    /// Proportion over all votes of the task's main measure.
    pub fn pooled(&self) -> Option<&ShareAnalysis> {
        self.shares.iter().find(|share| share.speaker.is_none() && share.condition.is_none())
    }

    fn statistic_sets(&self) -> impl Iterator<Item = &StatisticSet> {
        let shares = self.shares.iter().map(|share| &share.statistics);
        let scores = self.scores.iter().map(|row| &row.statistics);
        shares.chain(scores).chain(self.pairs.iter().map(|pair| &pair.statistics))
    }

    pub fn tests(&self) -> impl Iterator<Item = &TestResult> {
        self.statistic_sets().flat_map(|set| &set.tests).chain(&self.overall)
    }

    /// Origins of all intervals and tests of the task.
    pub fn origins(&self) -> impl Iterator<Item = StatisticOrigin> {
        let intervals = self.statistic_sets().flat_map(|set| &set.intervals).map(|interval| interval.origin);
        let equivalence = self.statistic_sets().flat_map(|set| &set.equivalence).map(|test| test.origin);
        intervals.chain(equivalence).chain(self.tests().map(|test| test.origin))
    }
}
