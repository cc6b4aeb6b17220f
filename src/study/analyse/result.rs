//! Result of an analysis, from which the page, the summary and the methods paragraph are made. Every figure says how it
//! was got, whether that was fixed before the data were seen, and whether it takes votes for independent.

use super::exclusion::ExclusionAccount;
use super::figure::{FigureOrigin, FigureSet, IntervalFigure, TestFigure};
use super::votes::read::RefusedRow;
use crate::file::AnalysisSettings;
use crate::plan::TaskDesign;
use serde::Serialize;

/// Analysis of a study.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StudyAnalysis {
    pub version: u32,
    pub title: String,
    /// File or folder of the votes, its name alone.
    pub source: String,
    /// Hash over the sealed study; none of votes that did not come with their study.
    pub seal: Option<String>,
    pub settings: FigureSettings,
    /// Rows of the source that are no votes.
    pub refused: Vec<RefusedRow>,
    pub exclusions: ExclusionAccount,
    /// What became of each registered hypothesis.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub hypotheses: Vec<JudgedHypothesis>,
    pub tasks: Vec<TaskAnalysis>,
    /// Tasks with the votes of everybody.
    pub without_exclusions: Vec<TaskAnalysis>,
    pub notes: Vec<String>,
    /// Paragraph for the methods section of a paper.
    pub methods: String,
}

/// Registered hypothesis with its outcome.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JudgedHypothesis {
    pub task: String,
    /// In words.
    pub claim: String,
    /// What judges it, as registered.
    pub statistic: String,
    /// One for each speaker, condition or pair that it is about; none where the task has no vote.
    pub claims: Vec<JudgedClaim>,
}

/// Outcome of a hypothesis for one speaker, condition or pair.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JudgedClaim {
    pub scope: String,
    /// Of the registered test, adjusted where it is one of several.
    pub p: Option<f64>,
    /// Whether the votes show it; none where the test could not be made.
    pub holds: Option<bool>,
}

impl JudgedClaim {
    /// Outcome in words. A test that does not reject shows nothing, so the opposite is never said.
    pub fn outcome(&self) -> &'static str {
        match self.holds {
            Some(true) => "shown",
            Some(false) => "not shown",
            None => "not tested",
        }
    }
}

/// What an analysis depends on beside the votes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FigureSettings {
    /// Coverage of the intervals.
    pub confidence: f64,
    /// Largest difference that counts as none, a share: 0.1 is 10 points of percent.
    pub bound: f64,
    /// Draws of sign flips and of participants; 0 leaves them out.
    pub n_draws: usize,
    pub seed: u64,
    /// Whether mixed models are fitted.
    pub with_models: bool,
}

impl FigureSettings {
    /// Error of the first kind of the tests that conclusions rest on.
    pub fn level(&self) -> f64 {
        1.0 - self.confidence
    }
}

impl From<&AnalysisSettings> for FigureSettings {
    /// Settings as they were registered.
    fn from(registered: &AnalysisSettings) -> Self {
        let AnalysisSettings { alpha, resamples, seed } = *registered;
        Self { confidence: 1.0 - alpha, n_draws: resamples, seed, ..Self::default() }
    }
}

impl Default for FigureSettings {
    fn default() -> Self {
        Self { confidence: 0.95, bound: 0.1, n_draws: 10_000, seed: 1, with_models: true }
    }
}

/// Analysis of a task.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TaskAnalysis {
    pub task: String,
    pub design: TaskDesign,
    pub n_votes: usize,
    pub n_participants: usize,
    pub n_clips: usize,
    pub conditions: Vec<String>,
    pub speakers: Vec<String>,
    /// What can be concluded, and what cannot.
    pub verdicts: Vec<String>,
    /// Shares of votes: all together first, then by speaker and by condition. Empty for preferences and sliders.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub shares: Vec<ShareAnalysis>,
    /// Scores by condition, the highest median first. Sliders alone.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub scores: Vec<ScoreAnalysis>,
    /// Pairs of conditions. Preferences and sliders, and single films.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub pairs: Vec<PairAnalysis>,
    /// Whether any condition differs from the others. Sliders alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub overall: Option<TestFigure>,
    /// Strengths of the conditions, the highest first. Preferences and sliders.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub strengths: Vec<StrengthFigure>,
    /// Krippendorff's alpha between participants, 1 for agreement and 0 for chance.
    pub agreement: Option<f64>,
    /// What could not be computed, and why.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<String>,
}

/// What share of votes is counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShareMeasure {
    /// Turing test: the generated film was taken for the real one.
    GeneratedChosen,
    /// Mismatch: the film with the motion of its own speech was chosen.
    MatchedChosen,
    /// Turing test of one film: the answer was right.
    Correct,
    /// Turing test of one film: the film was taken for real, right or wrong.
    TakenForReal,
}

/// Share of votes, against chance where there is one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ShareAnalysis {
    pub measure: ShareMeasure,
    /// None: all speakers.
    pub speaker: Option<String>,
    /// None: all conditions.
    pub condition: Option<String>,
    pub n_votes: u64,
    pub n_successes: u64,
    pub n_participants: usize,
    pub n_clips: usize,
    pub share: f64,
    #[serde(flatten)]
    pub figures: FigureSet,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<ModelFigure>,
    pub conclusion: Conclusion,
}

impl ShareAnalysis {
    /// Share of right responses: the real film found, the matched film chosen.
    pub fn right_share(&self) -> f64 {
        match self.measure {
            ShareMeasure::GeneratedChosen => 1.0 - self.share,
            ShareMeasure::MatchedChosen | ShareMeasure::Correct | ShareMeasure::TakenForReal => self.share,
        }
    }
}

/// Scores of a condition.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScoreAnalysis {
    pub condition: String,
    pub n_scores: usize,
    pub n_participants: usize,
    pub n_clips: usize,
    /// Minimum, 5 %, median, 95 %, maximum.
    pub quantiles: [f64; 5],
    pub median: f64,
    pub mean: f64,
    #[serde(flatten)]
    pub figures: FigureSet,
}

/// Two conditions that the same participants saw.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PairAnalysis {
    pub first: String,
    pub second: String,
    pub n_votes: usize,
    pub n_participants: usize,
    pub n_clips: usize,
    /// Votes that put the first above the second, neither, and the second above the first; none where each vote judged
    /// one of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub orders: Option<[u64; 3]>,
    /// Preferences: votes of each step, from the second clearly to the first clearly.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steps: Option<[u64; 5]>,
    /// Mean of the first less the second, in the scale's unit.
    pub difference: f64,
    #[serde(flatten)]
    pub figures: FigureSet,
    pub conclusion: Conclusion,
}

/// Strength of a condition among the others.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StrengthFigure {
    pub condition: String,
    /// Log odds of being put above a condition of mean strength (Bradley and Terry 1952).
    pub log_strength: f64,
    pub interval: Option<IntervalFigure>,
    /// The strength on the Elo scale; the mean is 1000.
    pub elo: f64,
}

/// Mixed logistic regression of the share.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelFigure {
    pub exploratory: bool,
    /// Share over all participants and clips.
    pub share: f64,
    /// Log odds of a typical participant and clip.
    pub log_odds: f64,
    pub standard_error: f64,
    /// Standard deviations of participants and of clips, log odds.
    pub sd_participants: f64,
    pub sd_clips: f64,
}

/// What a headline test and its equivalence test allow to say.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Conclusion {
    /// Above chance, or the first above the second.
    Above,
    Below,
    /// A difference was found, and it lies within the bound.
    AboveWithinBound,
    BelowWithinBound,
    /// No difference was found, and it lies within the bound.
    Equivalent,
    /// Neither a difference nor equivalence is shown.
    Undecided,
    /// There is no test.
    Untested,
}

impl Conclusion {
    /// Conclusion from a two-sided p value at `level`, the sign of the difference and the equivalence test.
    pub fn new(p: Option<f64>, level: f64, difference: f64, is_equivalent: bool) -> Self {
        match (p, is_equivalent) {
            (None, _) => Self::Untested,
            (Some(p), true) if p < level && difference > 0.0 => Self::AboveWithinBound,
            (Some(p), true) if p < level => Self::BelowWithinBound,
            (Some(p), false) if p < level && difference > 0.0 => Self::Above,
            (Some(p), false) if p < level => Self::Below,
            (Some(_), true) => Self::Equivalent,
            (Some(_), false) => Self::Undecided,
        }
    }
}

impl TaskAnalysis {
    /// Share of all votes of the measure that the task is about.
    pub fn pooled(&self) -> Option<&ShareAnalysis> {
        self.shares.iter().find(|share| share.speaker.is_none() && share.condition.is_none())
    }

    fn figure_sets(&self) -> impl Iterator<Item = &FigureSet> {
        let shares = self.shares.iter().map(|share| &share.figures);
        let scores = self.scores.iter().map(|row| &row.figures);
        shares.chain(scores).chain(self.pairs.iter().map(|pair| &pair.figures))
    }

    /// All tests of the task.
    pub fn tests(&self) -> impl Iterator<Item = &TestFigure> {
        self.figure_sets().flat_map(|set| &set.tests).chain(&self.overall)
    }

    /// Origins of all intervals and tests of the task.
    pub fn origins(&self) -> impl Iterator<Item = FigureOrigin> {
        let intervals = self.figure_sets().flat_map(|set| &set.intervals).map(|interval| interval.origin);
        let equivalence = self.figure_sets().flat_map(|set| &set.equivalence).map(|test| test.origin);
        intervals.chain(equivalence).chain(self.tests().map(|test| test.origin))
    }
}
