//! Statistics of an analysis: intervals, tests and equivalence tests of one quantity by several methods, each with its
//! origin, and those that could not be computed.

use crate::stats::estimate::{ConfidenceInterval, StatisticsError, StudentEstimate, holm};
use crate::stats::proportion::Equivalence;
use serde::Serialize;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StatisticMethod {
    /// Crossed standard error and t distribution: generalises to other participants and other clips.
    Crossed,
    /// Exact test over the plan's random assignment of sides.
    Sides,
    /// t test of participants' means, with fixed clips.
    Participants,
    /// Logistic regression with random intercepts of participants and clips.
    MixedModel,
    /// Signed-rank test of participants' mean differences.
    Wilcoxon,
    /// Signed-rank test of single votes, treated as independent.
    WilcoxonVotes,
    /// Friedman's test of participants' mean scores.
    Friedman,
    /// Order statistics of single scores, treated as independent.
    Median,
    /// Score interval of single votes, treated as independent.
    Wilson,
    /// Exact binomial test of single votes, treated as independent.
    Binomial,
    /// Bradley-Terry strengths, with participants resampled as clusters.
    BradleyTerry,
}

impl StatisticMethod {
    /// Whether the method treats votes as independent. Votes of one participant or about one clip are not.
    pub fn is_naive(self) -> bool {
        matches!(self, Self::WilcoxonVotes | Self::Median | Self::Wilson | Self::Binomial)
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Crossed => "participants and clips crossed",
            Self::Sides => "exact permutation of sides",
            Self::Participants => "t test of participants' means",
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

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct StatisticOrigin {
    pub method: StatisticMethod,
    /// Whether the method treats votes as independent.
    pub naive: bool,
    /// Whether the statistic was not pre-registered.
    pub exploratory: bool,
}

impl StatisticOrigin {
    /// Origin of a statistic that was not registered.
    pub fn new(method: StatisticMethod) -> Self {
        Self { method, naive: method.is_naive(), exploratory: true }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IntervalEstimate {
    #[serde(flatten)]
    pub origin: StatisticOrigin,
    #[serde(flatten)]
    pub ends: ConfidenceInterval,
}

/// Test of the null hypothesis of no difference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TestResult {
    #[serde(flatten)]
    pub origin: StatisticOrigin,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub statistic: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub degrees_of_freedom: Option<f64>,
    /// Two-sided p value.
    pub p: f64,
    /// Holm-adjusted p value, if the test belongs to a family: the tests of this method on the other parts of the task.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adjusted_p: Option<f64>,
}

impl TestResult {
    /// Test result with only a p value.
    pub fn new(method: StatisticMethod, p: f64) -> Self {
        Self { origin: StatisticOrigin::new(method), statistic: None, degrees_of_freedom: None, p, adjusted_p: None }
    }

    pub fn of_estimate(method: StatisticMethod, estimate: &StudentEstimate, expected: f64) -> Self {
        Self {
            statistic: Some(estimate.statistic(expected)),
            degrees_of_freedom: Some(estimate.degrees_of_freedom),
            ..Self::new(method, estimate.p_value(expected))
        }
    }

    /// p value, adjusted if the test belongs to a family.
    pub fn final_p(&self) -> f64 {
        self.adjusted_p.unwrap_or(self.p)
    }
}

/// Two one-sided tests that the difference lies within the bound.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EquivalenceResult {
    #[serde(flatten)]
    pub origin: StatisticOrigin,
    pub bound: f64,
    /// Larger of the two p values.
    pub p: f64,
    /// 90 % interval.
    #[serde(flatten)]
    pub ends: ConfidenceInterval,
    pub passes: bool,
}

/// Statistics of one quantity; the first of each kind is the most important.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct StatisticSet {
    pub intervals: Vec<IntervalEstimate>,
    pub tests: Vec<TestResult>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub equivalence: Vec<EquivalenceResult>,
    /// Statistics that could not be computed, with reasons.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<String>,
}

impl StatisticSet {
    /// Interval by `method`, if it was computed.
    pub fn interval(&self, method: StatisticMethod) -> Option<ConfidenceInterval> {
        self.intervals.iter().find(|interval| interval.origin.method == method).map(|interval| interval.ends)
    }

    /// Test by `method`, if it was computed.
    pub fn test(&self, method: StatisticMethod) -> Option<&TestResult> {
        self.tests.iter().find(|test| test.origin.method == method)
    }

    /// Equivalence test by `method`, if it was computed.
    pub fn equivalence(&self, method: StatisticMethod) -> Option<&EquivalenceResult> {
        self.equivalence.iter().find(|test| test.origin.method == method)
    }

    /// Statistics by method, those with an interval first.
    pub fn rows(&self) -> impl Iterator<Item = StatisticRow<'_>> {
        let of_interval = |&IntervalEstimate { origin, ends }: &IntervalEstimate| StatisticRow {
            origin,
            interval: Some(ends),
            test: self.test(origin.method),
        };
        let alone = self.tests.iter().filter(|test| self.interval(test.origin.method).is_none());
        let alone = alone.map(|test| StatisticRow { origin: test.origin, interval: None, test: Some(test) });
        self.intervals.iter().map(of_interval).chain(alone)
    }

    /// p value of the crossed test, adjusted if it belongs to a family.
    pub fn crossed_p(&self) -> Option<f64> {
        self.test(StatisticMethod::Crossed).map(TestResult::final_p)
    }

    /// Returns the value, or records the reason why it is missing.
    pub fn ok_or_record<T>(&mut self, method: StatisticMethod, value: Result<T, StatisticsError>) -> Option<T> {
        value.map_err(|error| self.missing.push(format!("{}: {error}", method.name()))).ok()
    }

    /// Adds an interval, or records the reason why it is missing.
    pub fn add_interval(&mut self, method: StatisticMethod, interval: Result<ConfidenceInterval, StatisticsError>) {
        if let Some(ends) = self.ok_or_record(method, interval) {
            self.intervals.push(IntervalEstimate { origin: StatisticOrigin::new(method), ends });
        }
    }

    /// Adds a p value, or records the reason why it is missing.
    pub fn add_test(&mut self, method: StatisticMethod, p: Result<f64, StatisticsError>) {
        if let Some(p) = self.ok_or_record(method, p) {
            self.tests.push(TestResult::new(method, p));
        }
    }

    /// Adds an equivalence test, or records the reason why it is missing.
    pub fn add_equivalence(&mut self, method: StatisticMethod, test: Result<Equivalence, StatisticsError>) {
        if let Some(test) = self.ok_or_record(method, test) {
            let (origin, passes) = (StatisticOrigin::new(method), test.passes());
            let Equivalence { bound, p, interval } = test;
            self.equivalence.push(EquivalenceResult { origin, bound, p, ends: interval, passes });
        }
    }

    /// Adds the interval of an estimate and its test against `expected`.
    pub fn add_estimate(
        &mut self,
        method: StatisticMethod,
        estimate: &StudentEstimate,
        expected: f64,
        confidence: f64,
    ) {
        self.add_interval(method, estimate.interval(confidence));
        self.tests.push(TestResult::of_estimate(method, estimate, expected));
    }

    /// Marks intervals and tests of a method as registered before data collection.
    pub fn register(&mut self, method: StatisticMethod) {
        let intervals = self.intervals.iter_mut().map(|interval| &mut interval.origin);
        let origins = intervals.chain(self.tests.iter_mut().map(|test| &mut test.origin));
        origins.filter(|origin| origin.method == method).for_each(|origin| origin.exploratory = false);
    }

    /// Marks the equivalence test of a method as registered before data collection.
    pub fn register_equivalence(&mut self, method: StatisticMethod) {
        let tests = self.equivalence.iter_mut().filter(|test| test.origin.method == method);
        tests.for_each(|test| test.origin.exploratory = false);
    }

    /// Clamps intervals to `low..=high`, which a t distribution may exceed.
    pub fn clamp(&mut self, low: f64, high: f64) {
        for IntervalEstimate { ends, .. } in &mut self.intervals {
            *ends = ConfidenceInterval { low: ends.low.clamp(low, high), high: ends.high.clamp(low, high) };
        }
    }
}

pub struct StatisticRow<'s> {
    pub origin: StatisticOrigin,
    pub interval: Option<ConfidenceInterval>,
    pub test: Option<&'s TestResult>,
}

/// Adjusts the tests of several sets, each method being one family (Holm 1979). A single set is left unchanged.
pub fn adjust(sets: &mut [&mut StatisticSet]) {
    if sets.len() < 2 {
        return;
    }
    let mut methods: Vec<StatisticMethod> =
        sets.iter().flat_map(|set| set.tests.iter().map(|test| test.origin.method)).collect();
    methods.sort_unstable();
    methods.dedup();
    for method in methods {
        let tests = sets.iter_mut().filter_map(|set| set.tests.iter_mut().find(|test| test.origin.method == method));
        let tests: Vec<&mut TestResult> = tests.collect();
        if let Ok(adjusted) = holm(&tests.iter().map(|test| test.p).collect::<Vec<_>>()) {
            tests.into_iter().zip(adjusted).for_each(|(test, p)| test.adjusted_p = Some(p));
        }
    }
}
