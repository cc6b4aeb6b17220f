//! Equivalence by two one-sided tests (TOST, Schuirmann 1987): whether a value lies within a bound of another. A
//! non-significant difference does not show equivalence; this test can. The bound must be fixed before the data are
//! seen.

use super::estimate::{ConfidenceInterval, StatisticsError, StudentEstimate, within};
use super::proportion::BinomialCount;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

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
