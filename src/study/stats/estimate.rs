//! Estimates with standard errors, their p values and intervals by Student's t distribution (Student 1908), and Holm's
//! step-down adjustment of several p values (Holm 1979), which controls the family-wise error rate under any dependence
//! of the tests.

pub use orator_base::math::estimate::ConfidenceInterval;
use orator_base::math::order::Ordered;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};
use std::ops::RangeInclusive;

/// Reason why a statistic cannot be computed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum StatisticsError {
    #[error("{found} {what}: at least {min} are required")]
    TooFew { what: &'static str, min: usize, found: usize },
    #[error("all {what} are equal: their variance cannot be estimated")]
    NoVariation { what: &'static str },
    #[error("invalid {what} {value}: expected {min} to {max}")]
    OutOfRange { what: &'static str, value: f64, min: f64, max: f64 },
    #[error("{what} contain a number that is not finite")]
    NotFinite { what: &'static str },
    #[error("one group of {what} never loses to the others: their strengths are not finite")]
    Unconnected { what: &'static str },
}

pub fn at_least(what: &'static str, min: usize, found: usize) -> Result<(), StatisticsError> {
    if found < min { Err(StatisticsError::TooFew { what, min, found }) } else { Ok(()) }
}

pub fn within(what: &'static str, value: f64, range: RangeInclusive<f64>) -> Result<(), StatisticsError> {
    let (min, max) = (*range.start(), *range.end());
    if range.contains(&value) { Ok(()) } else { Err(StatisticsError::OutOfRange { what, value, min, max }) }
}

pub fn finite(what: &'static str, values: &[f64]) -> Result<(), StatisticsError> {
    if values.iter().all(|value| value.is_finite()) { Ok(()) } else { Err(StatisticsError::NotFinite { what }) }
}

/// Tail probability on each side of an interval with this `confidence`, which must lie strictly between 0 and 1.
pub fn tail(confidence: f64) -> Result<f64, StatisticsError> {
    within("confidence", confidence, f64::EPSILON..=1.0 - f64::EPSILON)?;
    Ok((1.0 - confidence) / 2.0)
}

/// Percentile interval of `draws`; non-finite values are ignored.
pub fn interval_of_draws(
    draws: impl Iterator<Item = f64>,
    confidence: f64,
) -> Result<ConfidenceInterval, StatisticsError> {
    let (tail, sorted) = (tail(confidence)?, Ordered::new(draws));
    let at = |share| sorted.quantile(share).ok_or(StatisticsError::TooFew { what: "draws", min: 1, found: 0 });
    Ok(ConfidenceInterval { low: at(tail)?, high: at(1.0 - tail)? })
}

/// Estimate whose error divided by its standard error follows a t distribution.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StudentEstimate {
    pub value: f64,
    /// Standard error, above 0.
    pub standard_error: f64,
    /// Above 0, possibly fractional; infinite for the normal distribution.
    pub degrees_of_freedom: f64,
}

impl StudentEstimate {
    /// Creates an estimate.
    ///
    /// # Errors
    /// A value is not finite, or the standard error or the degrees of freedom are not positive.
    pub fn new(value: f64, standard_error: f64, degrees_of_freedom: f64) -> Result<Self, StatisticsError> {
        finite("values", &[value, standard_error])?;
        if standard_error <= 0.0 {
            return Err(StatisticsError::NoVariation { what: "values" });
        }
        if degrees_of_freedom.is_nan() || degrees_of_freedom <= 0.0 {
            return Err(StatisticsError::TooFew { what: "degrees of freedom", min: 1, found: 0 });
        }
        Ok(Self { value, standard_error, degrees_of_freedom })
    }

    /// Mean of at least two independent values, with n - 1 degrees of freedom.
    pub fn of_mean(values: &[f64]) -> Result<Self, StatisticsError> {
        at_least("values", 2, values.len())?;
        finite("values", values)?;
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        // Without this check, rounding would give equal values a tiny standard error above 0.
        let is_constant = values.iter().all(|value| *value == values[0]);
        Self::new(mean, if is_constant { 0.0 } else { (squares / (n * (n - 1.0))).sqrt() }, n - 1.0)
    }

    /// t statistic: distance from `expected` in standard errors.
    pub fn statistic(&self, expected: f64) -> f64 {
        (self.value - expected) / self.standard_error
    }

    /// Two-sided p value of the hypothesis that the true value is `expected`.
    pub fn p_value(&self, expected: f64) -> f64 {
        2.0 * self.upper_tail(self.statistic(expected).abs())
    }

    /// Two-sided confidence interval; `confidence` must lie strictly between 0 and 1.
    pub fn interval(&self, confidence: f64) -> Result<ConfidenceInterval, StatisticsError> {
        let half = self.quantile(1.0 - tail(confidence)?) * self.standard_error;
        Ok(ConfidenceInterval { low: self.value - half, high: self.value + half })
    }

    /// Probability of a statistic above `t`.
    pub fn upper_tail(&self, t: f64) -> f64 {
        // Above a million degrees of freedom the two distributions differ by less than 1e-6.
        let student = (self.degrees_of_freedom < 1e6).then(|| StudentsT::new(0.0, 1.0, self.degrees_of_freedom));
        student.and_then(Result::ok).map_or_else(|| Normal::standard().sf(t), |student| student.sf(t))
    }

    /// Value that the statistic exceeds with probability 1 - `share`.
    pub fn quantile(&self, share: f64) -> f64 {
        let student = (self.degrees_of_freedom < 1e4).then(|| StudentsT::new(0.0, 1.0, self.degrees_of_freedom));
        let expanded = || {
            // Expansion around the normal quantile (Fisher and Cornish 1960); its error is below 1e-7 here.
            let z = Normal::standard().inverse_cdf(share);
            z + (z.powi(3) + z) / (4.0 * self.degrees_of_freedom)
        };
        student.and_then(Result::ok).map_or_else(expanded, |student| student.inverse_cdf(share))
    }
}

/// Holm-adjusted p values in given order: a hypothesis is rejected at a level if its adjusted value is at most that.
///
/// # Errors
/// A p value is outside 0 to 1.
pub fn holm(p_values: &[f64]) -> Result<Vec<f64>, StatisticsError> {
    p_values.iter().try_for_each(|p| within("p value", *p, 0.0..=1.0))?;
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|a, b| p_values[*a].total_cmp(&p_values[*b]));
    let mut adjusted = vec![0.0; p_values.len()];
    let mut largest = 0.0f64;
    for (rank, index) in order.into_iter().enumerate() {
        largest = largest.max((p_values.len() - rank) as f64 * p_values[index]).min(1.0);
        adjusted[index] = largest;
    }
    Ok(adjusted)
}
