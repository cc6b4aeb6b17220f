//! Agreement of raters: Krippendorff's alpha (Krippendorff 2011), 1 for perfect agreement, 0 for chance, and its
//! bootstrap interval.

use super::error::{StatisticsError, at_least, finite, tail};
use super::estimate::ConfidenceInterval;
use orator_base::math::order::Ordered;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;

/// What differences of values mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum MeasurementScale {
    Nominal,
    Ordinal,
    Interval,
}

/// Agreement with its interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Agreement {
    pub alpha: f64,
    pub interval: ConfidenceInterval,
}

/// For each unit that at least two rated, how often each value occurs.
struct ValueCounts {
    values: Vec<f64>,
    units: Vec<Vec<f64>>,
}

impl ValueCounts {
    fn new(units: &[Vec<Option<f64>>]) -> Result<Self, StatisticsError> {
        let rated: Vec<Vec<f64>> = units.iter().map(|unit| unit.iter().copied().flatten().collect()).collect();
        let rated: Vec<Vec<f64>> = rated.into_iter().filter(|unit| unit.len() > 1).collect();
        at_least("units with two ratings", 1, rated.len())?;
        // -0 is 0.
        let mut values: Vec<f64> = rated.iter().flatten().map(|value| value + 0.0).collect();
        finite("ratings", &values)?;
        values.sort_unstable_by(f64::total_cmp);
        values.dedup();
        let count = |unit: &Vec<f64>| {
            values.iter().map(|value| unit.iter().filter(|rating| *rating == value).count() as f64).collect()
        };
        Ok(Self { units: rated.iter().map(count).collect(), values })
    }

    /// Alpha of the units, each as often as `times` says; `None` where all ratings agree on one value.
    fn alpha(&self, scale: MeasurementScale, times: &[f64]) -> Option<f64> {
        let mut totals = vec![0.0; self.values.len()];
        for (unit, times) in self.units.iter().zip(times) {
            totals.iter_mut().zip(unit).for_each(|(total, count)| *total += times * count);
        }
        let n: f64 = totals.iter().sum();
        let distance = self.squared_distances(scale, &totals);
        let disagreement = |counts: &[f64]| -> f64 {
            let present: Vec<usize> = (0..counts.len()).filter(|value| counts[*value] > 0.0).collect();
            let row = |a: &usize| present.iter().map(|b| counts[*a] * counts[*b] * distance(*a, *b)).sum::<f64>();
            present.iter().map(row).sum()
        };
        let within = self.units.iter().zip(times).filter(|(_, times)| **times > 0.0);
        let observed: f64 =
            within.map(|(unit, times)| times * disagreement(unit) / (unit.iter().sum::<f64>() - 1.0)).sum();
        let expected = disagreement(&totals) / (n - 1.0);
        (expected > 0.0).then(|| 1.0 - observed / expected)
    }

    /// Squared distance of two values by their places in `values`.
    fn squared_distances(&self, scale: MeasurementScale, totals: &[f64]) -> impl Fn(usize, usize) -> f64 {
        let mut before = 0.0;
        // Ordinal: ratings below a value and half of those on it.
        let places: Vec<f64> = match scale {
            MeasurementScale::Nominal => (0..totals.len()).map(|place| place as f64).collect(),
            MeasurementScale::Interval => self.values.clone(),
            MeasurementScale::Ordinal => {
                let middle = |total: &f64| {
                    before += total;
                    before - total / 2.0
                };
                totals.iter().map(middle).collect()
            }
        };
        move |a, b| match scale {
            MeasurementScale::Nominal => f64::from(u8::from(a != b)),
            _ => (places[a] - places[b]).powi(2),
        }
    }
}

/// Alpha of `units`, each with one rating or none of every rater. Units that fewer than two rated tell nothing.
pub fn alpha(units: &[Vec<Option<f64>>], scale: MeasurementScale) -> Result<f64, StatisticsError> {
    let counts = ValueCounts::new(units)?;
    let once = vec![1.0; counts.units.len()];
    counts.alpha(scale, &once).ok_or(StatisticsError::NoSpread { what: "ratings" })
}

/// Alpha with a percentile interval of `n_draws` draws of units with replacement. Hayes and Krippendorff 2007 draw pairs
/// of ratings instead, which takes those of one unit for independent; here units are, raters count as given. Draws in
/// which all ratings are one value are left out.
pub fn agreement(
    units: &[Vec<Option<f64>>],
    scale: MeasurementScale,
    confidence: f64,
    n_draws: usize,
    seed: u64,
) -> Result<Agreement, StatisticsError> {
    let tail = tail(confidence)?;
    let alpha = alpha(units, scale)?;
    let counts = ValueCounts::new(units)?;
    let n = counts.units.len();
    let draw = |k: u64| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(k);
        let mut times = vec![0.0; n];
        (0..n).for_each(|_| times[rng.random_range(0..n as u64) as usize] += 1.0);
        counts.alpha(scale, &times)
    };
    let draws: Vec<Option<f64>> = (0..n_draws as u64).into_par_iter().map(draw).collect();
    let sorted = Ordered::new(draws.into_iter().flatten());
    let at = |share| sorted.quantile(share).ok_or(StatisticsError::TooFew { what: "draws", least: 1, found: 0 });
    Ok(Agreement { alpha, interval: ConfidenceInterval { low: at(tail)?, high: at(1.0 - tail)? } })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_reference_package() {
        let golden: serde_json::Value =
            serde_json::from_str(include_str!("../../../fixtures/reference/study_stats_golden.json")).unwrap();
        for case in golden["krippendorff"].as_array().unwrap() {
            let units: Vec<Vec<Option<f64>>> = serde_json::from_value(case["units"].clone()).unwrap();
            for (scale, name) in [
                (MeasurementScale::Nominal, "nominal"),
                (MeasurementScale::Ordinal, "ordinal"),
                (MeasurementScale::Interval, "interval"),
            ] {
                let (found, expected) = (alpha(&units, scale).unwrap(), case[name].as_f64().unwrap());
                assert!((found - expected).abs() < 1e-12, "{name} {found} {expected}");
                let agreement = agreement(&units, scale, 0.95, 200, 1).unwrap();
                let interval = agreement.interval;
                assert!(interval.low <= agreement.alpha && agreement.alpha <= interval.high && interval.high <= 1.0);
            }
        }
    }

    #[test]
    fn agreement_on_everything_or_nothing() {
        let same = vec![vec![Some(2.0), Some(2.0)], vec![Some(5.0), Some(5.0)]];
        assert_eq!(alpha(&same, MeasurementScale::Interval), Ok(1.0));
        let constant = vec![vec![Some(2.0), Some(2.0)]; 3];
        assert!(matches!(alpha(&constant, MeasurementScale::Nominal), Err(StatisticsError::NoSpread { .. })));
        let lone = vec![vec![Some(2.0), None], vec![None, Some(1.0)]];
        assert!(matches!(alpha(&lone, MeasurementScale::Nominal), Err(StatisticsError::TooFew { .. })));
        assert!(alpha(&[], MeasurementScale::Ordinal).is_err());
        assert!(alpha(&[vec![Some(f64::NAN), Some(1.0)]], MeasurementScale::Ordinal).is_err());
        assert!(agreement(&same, MeasurementScale::Nominal, 0.95, 0, 1).is_err());
    }
}
