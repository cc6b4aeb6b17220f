//! Proportions of independent trials: Wilson and exact intervals, exact binomial test; votes of one participant or
//! about one clip are not independent, use `cluster` for those. Equivalence by two one-sided tests (TOST, Schuirmann
//! 1987), with a bound fixed before the data are seen: a non-significant difference does not show equivalence.

use super::estimate::{ConfidenceInterval, StatisticsError, StudentEstimate, at_least, tail, within};
use serde::Serialize;
use statrs::distribution::{Beta, Binomial, ContinuousCDF, Discrete, DiscreteCDF, Normal};

/// Relative tolerance within which outcomes count as equally likely as the observed one (as in scipy's `binomtest`).
const EQUALLY_LIKELY: f64 = 1e-7;

/// Number of successes among independent trials.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BinomialCount {
    successes: u64,
    trials: u64,
}

impl BinomialCount {
    /// Creates a count.
    ///
    /// # Errors
    /// No trials, or more successes than trials.
    pub fn new(successes: u64, trials: u64) -> Result<Self, StatisticsError> {
        at_least("votes", 1, trials.min(1) as usize)?;
        within("successes", successes as f64, 0.0..=trials as f64)?;
        Ok(Self { successes, trials })
    }

    /// Proportion of successes, 0 to 1.
    pub fn share(&self) -> f64 {
        self.successes as f64 / self.trials as f64
    }

    /// Score interval (Wilson 1927): its coverage is close to `confidence` on average over proportions.
    pub fn wilson(&self, confidence: f64) -> Result<ConfidenceInterval, StatisticsError> {
        let z = Normal::standard().inverse_cdf(1.0 - tail(confidence)?);
        let (n, share) = (self.trials as f64, self.share());
        let scale = 1.0 + z * z / n;
        let centre = (share + z * z / (2.0 * n)) / scale;
        let half = z / scale * (share * (1.0 - share) / n + z * z / (4.0 * n * n)).sqrt();
        // Exactly 0 and 1 in these cases, apart from rounding.
        let low = if self.successes == 0 { 0.0 } else { centre - half };
        let high = if self.successes == self.trials { 1.0 } else { centre + half };
        Ok(ConfidenceInterval { low, high })
    }

    /// Exact interval (Clopper and Pearson 1934): its coverage is at least `confidence` for every proportion.
    pub fn exact(&self, confidence: f64) -> Result<ConfidenceInterval, StatisticsError> {
        let tail = tail(confidence)?;
        let (k, n) = (self.successes as f64, self.trials as f64);
        let quantile = |share, a, b| Beta::new(a, b).map(|beta| beta.inverse_cdf(share));
        let low = quantile(tail, k, n - k + 1.0).unwrap_or(0.0);
        let high = quantile(1.0 - tail, k + 1.0, n - k).unwrap_or(1.0);
        Ok(ConfidenceInterval { low, high })
    }

    /// Exact two-sided p value of the hypothesis that each trial succeeds with `probability`: the total probability of
    /// all outcomes that are at most as likely as the observed one.
    pub fn test(&self, probability: f64) -> Result<f64, StatisticsError> {
        let distribution = self.distribution(probability)?;
        let (k, n) = (self.successes, self.trials);
        let mean = probability * n as f64;
        let observed = distribution.pmf(k) * (1.0 + EQUALLY_LIKELY);
        let is_unlikely = |outcome: u64| distribution.pmf(outcome) <= observed;
        let p = if k as f64 == mean {
            1.0
        } else if (k as f64) < mean {
            let other = partition_point(mean.ceil() as u64, n + 1, is_unlikely);
            self.at_most(probability)? + tail_from(&distribution, other)
        } else {
            let other = partition_point(0, mean.floor() as u64 + 1, |outcome| !is_unlikely(outcome));
            self.at_least(probability)? + other.checked_sub(1).map_or(0.0, |last| distribution.cdf(last))
        };
        Ok(p.min(1.0))
    }

    /// Probability of at most this many successes if each trial succeeds with `probability`.
    pub fn at_most(&self, probability: f64) -> Result<f64, StatisticsError> {
        Ok(self.distribution(probability)?.cdf(self.successes))
    }

    /// Probability of at least this many successes if each trial succeeds with `probability`.
    pub fn at_least(&self, probability: f64) -> Result<f64, StatisticsError> {
        Ok(tail_from(&self.distribution(probability)?, self.successes))
    }

    fn distribution(&self, probability: f64) -> Result<Binomial, StatisticsError> {
        within("probability", probability, 0.0..=1.0)?;
        let invalid = StatisticsError::OutOfRange { what: "probability", value: probability, min: 0.0, max: 1.0 };
        Binomial::new(probability, self.trials).map_err(|_| invalid)
    }
}

fn tail_from(distribution: &Binomial, outcome: u64) -> f64 {
    outcome.checked_sub(1).map_or(1.0, |before| distribution.sf(before))
}

/// Smallest value in `low..high` for which the monotone `holds` is true, by bisection; `high` if there is none.
fn partition_point(mut low: u64, mut high: u64, holds: impl Fn(u64) -> bool) -> u64 {
    while low < high {
        let middle = low + (high - low) / 2;
        if holds(middle) { high = middle } else { low = middle + 1 }
    }
    low
}

/// Significance level of each one-sided test.
const LEVEL: f64 = 0.05;

/// Result of two one-sided tests.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Equivalence {
    /// Equivalence bound, in the unit of the estimate: 0.05 is 5 percentage points of a proportion.
    pub bound: f64,
    /// Larger of the two one-sided p values.
    pub p: f64,
    /// 90 % interval of the value; inside the bounds if and only if the test passes.
    #[serde(flatten)]
    pub interval: ConfidenceInterval,
}

impl Equivalence {
    /// Tests at 5 % whether the true value of `estimate` is less than `bound` away from `expected`.
    ///
    /// # Errors
    /// `bound` is not positive.
    pub fn of_estimate(estimate: &StudentEstimate, expected: f64, bound: f64) -> Result<Self, StatisticsError> {
        within("bound", bound, f64::MIN_POSITIVE..=f64::MAX)?;
        let above = estimate.upper_tail(estimate.statistic(expected - bound));
        let below = estimate.upper_tail(-estimate.statistic(expected + bound));
        Ok(Self { bound, p: above.max(below), interval: estimate.interval(1.0 - 2.0 * LEVEL)? })
    }

    /// Exact binomial version for independent trials; both bounds must lie between 0 and 1.
    ///
    /// # Errors
    /// A bound is outside 0 to 1.
    pub fn of_count(count: &BinomialCount, expected: f64, bound: f64) -> Result<Self, StatisticsError> {
        within("bound", bound, f64::MIN_POSITIVE..=1.0)?;
        let p = count.at_least(expected - bound)?.max(count.at_most(expected + bound)?);
        Ok(Self { bound, p, interval: count.exact(1.0 - 2.0 * LEVEL)? })
    }

    /// Whether equivalence within the bound is significant at 5 %.
    pub fn passes(&self) -> bool {
        self.p < LEVEL
    }
}

/// Number of independent votes for which two one-sided tests at 5 % pass with probability `power` if the true
/// proportion is one half: (z(0.95) + z((1 + power) / 2))^2 / (4 bound^2), rounded up.
///
/// # Errors
/// `bound` is outside 1e-6 to 0.5, or `power` is outside 0 to below 1.
pub fn votes_needed(bound: f64, power: f64) -> Result<u64, StatisticsError> {
    within("bound", bound, 1e-6..=0.5)?;
    within("power", power, 0.0..=1.0 - f64::EPSILON)?;
    let normal = Normal::standard();
    let z = normal.inverse_cdf(1.0 - LEVEL) + normal.inverse_cdf((1.0 + power) / 2.0);
    Ok((z * z / (4.0 * bound * bound)).ceil() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts of Rebol, Guetl and Pietroszek 2021, section 4.5, with votes treated as independent.
    #[test]
    fn p_values_of_the_papers_votes_match() {
        let p = |successes, trials| BinomialCount::new(successes, trials).unwrap().test(0.5).unwrap();
        let near = |found: f64, expected: f64| assert!((found - expected).abs() < 5e-4, "{found} {expected}");
        near(p(1050, 2000), 0.027);
        near(p(538, 1000), 0.018);
        near(p(512, 1000), 0.467);
        // 71.2 % and 58.8 % of 500 chose the matching sound.
        assert!(p(356, 500) < 1e-20 && p(294, 500) < 1e-4);
    }

    #[test]
    fn extreme_counts_and_invalid_arguments() {
        let none = BinomialCount::new(0, 20).unwrap();
        let all = BinomialCount::new(20, 20).unwrap();
        assert_eq!((none.exact(0.95).unwrap().low, all.exact(0.95).unwrap().high), (0.0, 1.0));
        assert_eq!((none.wilson(0.95).unwrap().low, all.wilson(0.95).unwrap().high), (0.0, 1.0));
        assert_eq!((none.test(0.0).unwrap(), all.test(1.0).unwrap(), all.test(0.0).unwrap()), (1.0, 1.0, 0.0));
        assert!((all.test(0.5).unwrap() - 2.0 * 0.5f64.powi(20)).abs() < 1e-18);
        assert!(BinomialCount::new(0, 0).is_err() && BinomialCount::new(3, 2).is_err());
        assert!(none.test(f64::NAN).is_err() && none.test(1.5).is_err() && none.wilson(0.0).is_err());
    }

    /// 1,050 of 2,000 votes, the pooled counts of Rebol, Guetl and Pietroszek 2021, section 4.5.
    #[test]
    fn pooled_votes_of_the_paper_are_equivalent_to_chance() {
        let count = BinomialCount::new(1050, 2000).unwrap();
        let exact = |bound| Equivalence::of_count(&count, 0.5, bound).unwrap();
        assert!((exact(0.10).p / 6.51e-12 - 1.0).abs() < 0.01 && exact(0.10).passes(), "{}", exact(0.10).p);
        assert!((exact(0.05).p - 0.0131).abs() < 5e-5 && exact(0.05).passes(), "{}", exact(0.05).p);
        assert!(!exact(0.03).passes());
        let estimate = StudentEstimate::new(0.525, (0.525f64 * 0.475 / 2000.0).sqrt(), f64::INFINITY).unwrap();
        let asymptotic = Equivalence::of_estimate(&estimate, 0.5, 0.05).unwrap();
        assert!((asymptotic.p - 0.0126).abs() < 5e-5, "{}", asymptotic.p);
    }

    #[test]
    fn votes_for_equivalence_follow_the_formula() {
        assert_eq!([0.05, 0.10].map(|bound| votes_needed(bound, 0.9).unwrap()), [1083, 271]);
        assert!(votes_needed(0.0, 0.9).is_err() && votes_needed(0.05, 1.0).is_err());
    }

    /// The interval is inside the bounds exactly where the test passes.
    #[test]
    fn interval_and_p_value_agree() {
        for value in [0.47, 0.5, 0.52, 0.529, 0.531, 0.56] {
            let estimate = StudentEstimate::new(value, 0.012, 39.0).unwrap();
            let test = Equivalence::of_estimate(&estimate, 0.5, 0.05).unwrap();
            let inside = test.interval.low > 0.45 && test.interval.high < 0.55;
            assert_eq!(inside, test.passes(), "{value}");
        }
        let estimate = StudentEstimate::new(0.5, 0.01, 9.0).unwrap();
        assert!(Equivalence::of_estimate(&estimate, 0.5, f64::NAN).is_err());
        assert!(Equivalence::of_count(&BinomialCount::new(1, 2).unwrap(), 0.95, 0.1).is_err());
    }
}
