//! An estimate with its standard error, judged by Student's t distribution (Student 1908): p value and interval.

use super::error::{StatisticsError, at_least, finite, tail};
pub use orator_base::math::estimate::ConfidenceInterval;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// Estimate whose error, divided by its standard error, follows a t distribution.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StudentEstimate {
    pub value: f64,
    /// Above 0.
    pub standard_error: f64,
    /// Above 0, whole or not; infinite for the normal distribution.
    pub degrees_of_freedom: f64,
}

impl StudentEstimate {
    /// Refuses numbers that are not finite and a standard error of 0.
    pub fn new(value: f64, standard_error: f64, degrees_of_freedom: f64) -> Result<Self, StatisticsError> {
        finite("values", &[value, standard_error])?;
        if standard_error <= 0.0 {
            return Err(StatisticsError::NoSpread { what: "values" });
        }
        if degrees_of_freedom.is_nan() || degrees_of_freedom <= 0.0 {
            return Err(StatisticsError::TooFew { what: "degrees of freedom", least: 1, found: 0 });
        }
        Ok(Self { value, standard_error, degrees_of_freedom })
    }

    /// Mean of independent values with n - 1 degrees of freedom.
    pub fn of_mean(values: &[f64]) -> Result<Self, StatisticsError> {
        at_least("values", 2, values.len())?;
        finite("values", values)?;
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        // Rounding alone makes equal values differ from their mean by a few last places.
        let is_constant = values.iter().all(|value| *value == values[0]);
        Self::new(mean, if is_constant { 0.0 } else { (squares / (n * (n - 1.0))).sqrt() }, n - 1.0)
    }

    /// Distance from `expected` in standard errors.
    pub fn statistic(&self, expected: f64) -> f64 {
        (self.value - expected) / self.standard_error
    }

    /// Two-sided p value of the hypothesis that the true value is `expected`.
    pub fn p_value(&self, expected: f64) -> f64 {
        2.0 * self.beyond(self.statistic(expected).abs())
    }

    pub fn interval(&self, confidence: f64) -> Result<ConfidenceInterval, StatisticsError> {
        let half = self.quantile(1.0 - tail(confidence)?) * self.standard_error;
        Ok(ConfidenceInterval { low: self.value - half, high: self.value + half })
    }

    /// Probability of a statistic above `t`.
    pub fn beyond(&self, t: f64) -> f64 {
        // Above a million degrees of freedom the distributions differ by less than a millionth.
        let student = (self.degrees_of_freedom < 1e6).then(|| StudentsT::new(0.0, 1.0, self.degrees_of_freedom));
        student.and_then(Result::ok).map_or_else(|| Normal::standard().sf(t), |student| student.sf(t))
    }

    /// Value which the statistic exceeds with probability 1 - `share`.
    fn quantile(&self, share: f64) -> f64 {
        let student = (self.degrees_of_freedom < 1e4).then(|| StudentsT::new(0.0, 1.0, self.degrees_of_freedom));
        let expanded = || {
            // Expansion about the normal quantile (Fisher and Cornish 1960); its error is below 1e-7 here.
            let z = Normal::standard().inverse_cdf(share);
            z + (z.powi(3) + z) / (4.0 * self.degrees_of_freedom)
        };
        student.and_then(Result::ok).map_or_else(expanded, |student| student.inverse_cdf(share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_scipy() {
        let golden: serde_json::Value =
            serde_json::from_str(include_str!("../../../fixtures/reference/study_stats_golden.json")).unwrap();
        for case in golden["mean"].as_array().unwrap() {
            let values: Vec<f64> = serde_json::from_value(case["values"].clone()).unwrap();
            let mean = StudentEstimate::of_mean(&values).unwrap();
            let interval = mean.interval(0.95).unwrap();
            let found = [mean.value, mean.standard_error, mean.p_value(0.5), interval.low, interval.high];
            for (found, name) in found.into_iter().zip(["mean", "standard_error", "p", "low", "high"]) {
                let expected = case[name].as_f64().unwrap();
                assert!((found - expected).abs() <= 1e-9 * expected.abs().max(1e-3), "{name} {found} {expected}");
            }
        }
        for case in golden["t_quantile"].as_array().unwrap() {
            let [freedom, share, expected] = serde_json::from_value::<[f64; 3]>(case.clone()).unwrap();
            let found = StudentEstimate::new(0.0, 1.0, freedom).unwrap().quantile(share);
            // Beyond 10,000 degrees of freedom an expansion is used.
            let bound = if freedom < 1e4 { 1e-10 } else { 1e-7 };
            assert!((found / expected - 1.0).abs() < bound, "{freedom} {share} {found} {expected}");
        }
        let normal = StudentEstimate::new(0.0, 1.0, f64::INFINITY).unwrap().interval(0.95).unwrap();
        assert!((normal.high - 1.959963984540054).abs() < 1e-12);
    }

    #[test]
    fn what_has_no_spread_has_no_estimate() {
        assert_eq!(StudentEstimate::of_mean(&[0.3; 7]), Err(StatisticsError::NoSpread { what: "values" }));
        assert!(matches!(StudentEstimate::of_mean(&[0.5]), Err(StatisticsError::TooFew { .. })));
        assert!(matches!(StudentEstimate::of_mean(&[0.5, f64::NAN]), Err(StatisticsError::NotFinite { .. })));
        assert!(StudentEstimate::new(0.0, 1.0, 0.0).is_err() && StudentEstimate::new(0.0, 1.0, f64::NAN).is_err());
        let estimate = StudentEstimate::new(0.0, 1.0, 5.0).unwrap();
        assert!(estimate.interval(1.0).is_err() && estimate.interval(f64::NAN).is_err());
    }
}
