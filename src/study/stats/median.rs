//! Median with a distribution-free interval, as the GENEA challenges print their ratings (Kucherenko et al. 2021).

use super::error::{StatisticsError, finite, tail};
use super::estimate::ConfidenceInterval;
use orator_base::math::order::median;
use serde::Serialize;
use statrs::distribution::{Binomial, DiscreteCDF};

/// Median with its interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MedianEstimate {
    pub median: f64,
    pub interval: ConfidenceInterval,
    /// Probability with which such an interval covers the true median, at least the confidence asked for.
    pub coverage: f64,
}

/// Median of independent `values` with the narrowest symmetric pair of order statistics that covers the true one with
/// at least `confidence`, by the binomial distribution of the values below it (Hahn and Meeker 1991, section 5.2).
/// Exact for any continuous distribution, conservative where values tie. Six values are needed for 95 %.
pub fn median_estimate(values: &[f64], confidence: f64) -> Result<MedianEstimate, StatisticsError> {
    let tail = tail(confidence)?;
    finite("values", values)?;
    let n = values.len();
    let too_few = |least| StatisticsError::TooFew { what: "values", least, found: n };
    let below = Binomial::new(0.5, n as u64).map_err(|_| too_few(1))?;
    // The interval leaves out `outside` values at each end: fewer than or as many lie below the median in a tail.
    let Some(outside) = (0..n.div_ceil(2) as u64).take_while(|rank| below.cdf(*rank) <= tail).last() else {
        return Err(too_few((-tail.log2()).ceil() as usize));
    };
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let interval = ConfidenceInterval { low: sorted[outside as usize], high: sorted[n - 1 - outside as usize] };
    let median = median(sorted).ok_or(too_few(1))?;
    Ok(MedianEstimate { median, interval, coverage: 1.0 - 2.0 * below.cdf(outside) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_binomial_distribution() {
        let golden: serde_json::Value =
            serde_json::from_str(include_str!("../../../fixtures/reference/study_stats_golden.json")).unwrap();
        for case in golden["median"].as_array().unwrap() {
            let values: Vec<f64> = serde_json::from_value(case["values"].clone()).unwrap();
            let found = median_estimate(&values, 0.95).unwrap();
            let numbers = [found.median, found.interval.low, found.interval.high, found.coverage];
            for (found, name) in numbers.into_iter().zip(["median", "low", "high", "coverage"]) {
                let expected = case[name].as_f64().unwrap();
                assert!((found - expected).abs() < 1e-9, "{name} {found} {expected}");
            }
        }
    }

    #[test]
    fn six_values_are_needed() {
        let six = [3.0, 1.0, 6.0, 2.0, 5.0, 4.0];
        let found = median_estimate(&six, 0.95).unwrap();
        assert_eq!((found.median, found.interval), (3.5, ConfidenceInterval { low: 1.0, high: 6.0 }));
        assert!((found.coverage - 0.96875).abs() < 1e-12);
        let few = Err(StatisticsError::TooFew { what: "values", least: 6, found: 5 });
        assert_eq!(median_estimate(&six[..5], 0.95), few);
        assert!(median_estimate(&[], 0.95).is_err() && median_estimate(&[f64::NAN; 9], 0.95).is_err());
        assert_eq!(median_estimate(&[2.0; 9], 0.95).unwrap().interval, ConfidenceInterval { low: 2.0, high: 2.0 });
    }
}
