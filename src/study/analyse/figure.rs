//! A figure of an analysis: interval, test or test of equivalence, with where it comes from.

use serde::Serialize;

/// How a figure was got.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FigureMethod {
    /// Crossed standard error, t distribution: holds for other participants and other clips.
    Crossed,
    /// Bootstrap of participants and clips.
    CrossedBootstrap,
    /// Sign flips of participants and clips.
    SignFlip,
    /// Exact test over the plan's own draw of sides.
    Sides,
    /// t test of participants' means: clips as given.
    Participants,
    /// Logistic regression with random participants and clips.
    MixedModel,
    /// Signed ranks of participants' mean differences.
    Wilcoxon,
    /// Signed ranks of single votes, taken for independent.
    WilcoxonVotes,
    /// Ranks of participants' mean scores.
    Friedman,
    /// Order statistics of single scores, taken for independent.
    Median,
    /// Score interval of single votes, taken for independent.
    Wilson,
    /// Exact binomial test of single votes, taken for independent.
    Binomial,
    /// Strengths with participants as clusters.
    BradleyTerry,
}

impl FigureMethod {
    /// Whether votes are taken for independent, which votes of one participant or about one clip are not.
    pub fn is_naive(self) -> bool {
        matches!(self, Self::WilcoxonVotes | Self::Median | Self::Wilson | Self::Binomial)
    }

    /// Name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Crossed => "participants and clips crossed",
            Self::CrossedBootstrap => "bootstrap of participants and clips",
            Self::SignFlip => "sign flips of participants and clips",
            Self::Sides => "exact permutation of sides",
            Self::Participants => "t test of participants' shares",
            Self::MixedModel => "mixed logistic regression",
            Self::Wilcoxon => "Wilcoxon, participants' means",
            Self::WilcoxonVotes => "Wilcoxon, single votes",
            Self::Friedman => "Friedman, participants' means",
            Self::Median => "median of single scores",
            Self::Wilson => "Wilson",
            Self::Binomial => "exact binomial",
            Self::BradleyTerry => "Bradley-Terry",
        }
    }
}

/// Where a figure comes from: its method, and whether that was written down before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct FigureOrigin {
    pub method: FigureMethod,
    /// Whether votes are taken for independent.
    pub naive: bool,
    /// Whether it was not pre-registered.
    pub exploratory: bool,
}

impl FigureOrigin {
    /// Origin of a figure that nobody registered.
    pub fn new(method: FigureMethod) -> Self {
        Self { method, naive: method.is_naive(), exploratory: true }
    }
}

/// Confidence interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IntervalFigure {
    #[serde(flatten)]
    pub origin: FigureOrigin,
    pub low: f64,
    pub high: f64,
}

/// Test of the hypothesis that there is no difference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TestFigure {
    #[serde(flatten)]
    pub origin: FigureOrigin,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub statistic: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub degrees_of_freedom: Option<f64>,
    /// Two-sided.
    pub p: f64,
    /// By Holm's method among the tests of this method on the other parts of the task.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adjusted_p: Option<f64>,
}

impl TestFigure {
    /// Test without more than its p value.
    pub fn new(method: FigureMethod, p: f64) -> Self {
        Self { origin: FigureOrigin::new(method), statistic: None, degrees_of_freedom: None, p, adjusted_p: None }
    }
}

/// Two one-sided tests that the difference lies within the bound.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EquivalenceFigure {
    #[serde(flatten)]
    pub origin: FigureOrigin,
    pub bound: f64,
    /// Larger of the two p values.
    pub p: f64,
    /// 90 % interval.
    pub low: f64,
    pub high: f64,
    pub passes: bool,
}
