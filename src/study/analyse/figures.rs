//! Intervals and tests of one number by several methods, with what could not be computed.

use super::figure::{EquivalenceFigure, FigureMethod, FigureOrigin, IntervalFigure, TestFigure};
use crate::stats::equivalence::Equivalence;
use crate::stats::error::StatisticsError;
use crate::stats::estimate::{ConfidenceInterval, StudentEstimate};
use crate::stats::holm::holm;
use serde::Serialize;

/// Figures about one number, the first of each kind the one to look at first.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FigureSet {
    pub intervals: Vec<IntervalFigure>,
    pub tests: Vec<TestFigure>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub equivalence: Vec<EquivalenceFigure>,
    /// What could not be computed, and why.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<String>,
}

impl FigureSet {
    pub fn interval(&self, method: FigureMethod) -> Option<&IntervalFigure> {
        self.intervals.iter().find(|interval| interval.origin.method == method)
    }

    pub fn test(&self, method: FigureMethod) -> Option<&TestFigure> {
        self.tests.iter().find(|test| test.origin.method == method)
    }

    pub fn equivalence(&self, method: FigureMethod) -> Option<&EquivalenceFigure> {
        self.equivalence.iter().find(|test| test.origin.method == method)
    }

    /// Notes why a value is missing, or gives it.
    pub fn known<T>(&mut self, method: FigureMethod, value: Result<T, StatisticsError>) -> Option<T> {
        value.map_err(|error| self.missing.push(format!("{}: {error}", method.name()))).ok()
    }

    pub fn add_interval(&mut self, method: FigureMethod, interval: Result<ConfidenceInterval, StatisticsError>) {
        if let Some(ConfidenceInterval { low, high }) = self.known(method, interval) {
            self.intervals.push(IntervalFigure { origin: FigureOrigin::new(method), low, high });
        }
    }

    pub fn add_test(&mut self, method: FigureMethod, p: Result<f64, StatisticsError>) {
        if let Some(p) = self.known(method, p) {
            self.tests.push(TestFigure::new(method, p));
        }
    }

    pub fn add_equivalence(&mut self, method: FigureMethod, test: Result<Equivalence, StatisticsError>) {
        if let Some(test) = self.known(method, test) {
            let ConfidenceInterval { low, high } = test.interval;
            let (origin, passes) = (FigureOrigin::new(method), test.passes());
            self.equivalence.push(EquivalenceFigure { origin, bound: test.bound, p: test.p, low, high, passes });
        }
    }

    /// Adds the interval of an estimate and its test against `expected`.
    pub fn add_estimate(&mut self, method: FigureMethod, estimate: &StudentEstimate, expected: f64, confidence: f64) {
        self.add_interval(method, estimate.interval(confidence));
        self.tests.push(TestFigure {
            statistic: Some(estimate.statistic(expected)),
            degrees_of_freedom: Some(estimate.degrees_of_freedom),
            ..TestFigure::new(method, estimate.p_value(expected))
        });
    }

    /// Marks intervals and tests of a method as registered before the data were seen.
    pub fn register(&mut self, method: FigureMethod) {
        let intervals = self.intervals.iter_mut().map(|interval| &mut interval.origin);
        let origins = intervals.chain(self.tests.iter_mut().map(|test| &mut test.origin));
        origins.filter(|origin| origin.method == method).for_each(|origin| origin.exploratory = false);
    }

    /// Marks the equivalence test of a method as registered before the data were seen.
    pub fn register_equivalence(&mut self, method: FigureMethod) {
        let tests = self.equivalence.iter_mut().filter(|test| test.origin.method == method);
        tests.for_each(|test| test.origin.exploratory = false);
    }

    /// Keeps intervals within `low` to `high`, over which a t distribution may carry them.
    pub fn clamp(&mut self, low: f64, high: f64) {
        for interval in &mut self.intervals {
            interval.low = interval.low.clamp(low, high);
            interval.high = interval.high.clamp(low, high);
        }
    }
}

/// Adjusts the tests of several sets, method by method, as one family each (Holm 1979). A single set is left alone.
pub fn adjust(sets: &mut [&mut FigureSet]) {
    if sets.len() < 2 {
        return;
    }
    let mut methods: Vec<FigureMethod> =
        sets.iter().flat_map(|set| set.tests.iter().map(|test| test.origin.method)).collect();
    methods.sort_unstable();
    methods.dedup();
    for method in methods {
        let tests = sets.iter_mut().filter_map(|set| set.tests.iter_mut().find(|test| test.origin.method == method));
        let tests: Vec<&mut TestFigure> = tests.collect();
        if let Ok(adjusted) = holm(&tests.iter().map(|test| test.p).collect::<Vec<_>>()) {
            tests.into_iter().zip(adjusted).for_each(|(test, p)| test.adjusted_p = Some(p));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tests_of_one_method_are_a_family() {
        let set = |p: &[(FigureMethod, f64)]| FigureSet {
            tests: p.iter().map(|(method, p)| TestFigure::new(*method, *p)).collect(),
            ..FigureSet::default()
        };
        let (crossed, wilson) = (FigureMethod::Crossed, FigureMethod::Binomial);
        let mut sets = [set(&[(crossed, 0.01), (wilson, 0.03)]), set(&[(crossed, 0.04)]), set(&[(wilson, 0.02)])];
        let [a, b, c] = &mut sets;
        adjust(&mut [a, b, c]);
        let adjusted = |set: &FigureSet| set.tests.iter().filter_map(|test| test.adjusted_p).collect::<Vec<_>>();
        assert_eq!([&sets[0], &sets[1], &sets[2]].map(adjusted), [vec![0.02, 0.04], vec![0.04], vec![0.04]]);
        adjust(&mut [&mut sets[1]]);
        assert_eq!(adjusted(&sets[1]), [0.04]);
    }
}
