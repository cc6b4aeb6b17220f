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
