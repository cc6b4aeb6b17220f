//! Agreement of raters: Krippendorff's alpha (Krippendorff 2011), 1 for perfect agreement, 0 for chance.

use super::estimate::{StatisticsError, at_least, finite};

/// What differences of values mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeasurementScale {
    Nominal,
    Ordinal,
    Interval,
}

/// Alpha of `units`, each with the ratings that it was given. Units that fewer than two rated tell nothing.
pub fn alpha(units: &[Vec<f64>], scale: MeasurementScale) -> Result<f64, StatisticsError> {
    let rated: Vec<&Vec<f64>> = units.iter().filter(|unit| unit.len() > 1).collect();
    at_least("units with two ratings", 1, rated.len())?;
    // -0 is 0.
    let mut values: Vec<f64> = rated.iter().flat_map(|unit| unit.iter().map(|value| value + 0.0)).collect();
    finite("ratings", &values)?;
    values.sort_unstable_by(f64::total_cmp);
    values.dedup();
    let count = |unit: &Vec<f64>, value: &f64| unit.iter().filter(|rating| *rating == value).count() as f64;
    let counts: Vec<Vec<f64>> =
        rated.iter().map(|unit| values.iter().map(|value| count(unit, value)).collect()).collect();
    let totals: Vec<f64> = (0..values.len()).map(|value| counts.iter().map(|unit| unit[value]).sum()).collect();
    let distance = squared_distances(scale, values, &totals);
    let disagreement = |counts: &[f64]| -> f64 {
        let present: Vec<usize> = (0..counts.len()).filter(|value| counts[*value] > 0.0).collect();
        let row = |a: &usize| present.iter().map(|b| counts[*a] * counts[*b] * distance(*a, *b)).sum::<f64>();
        present.iter().map(row).sum()
    };
    let observed: f64 = counts.iter().map(|unit| disagreement(unit) / (unit.iter().sum::<f64>() - 1.0)).sum();
    let expected = disagreement(&totals) / (totals.iter().sum::<f64>() - 1.0);
    if expected > 0.0 { Ok(1.0 - observed / expected) } else { Err(StatisticsError::NoSpread { what: "ratings" }) }
}

/// Squared distance of two of the ascending `values` by their places; `totals` says how often each occurs.
fn squared_distances(scale: MeasurementScale, values: Vec<f64>, totals: &[f64]) -> impl Fn(usize, usize) -> f64 {
    let mut before = 0.0;
    // Ordinal: ratings below a value and half of those on it.
    let middle = |total: &f64| {
        before += total;
        before - total / 2.0
    };
    let places = if scale == MeasurementScale::Ordinal { totals.iter().map(middle).collect() } else { values };
    move |a, b| match scale {
        MeasurementScale::Nominal => f64::from(u8::from(a != b)),
        _ => (places[a] - places[b]).powi(2),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agreement_on_everything_or_nothing() {
        let same = vec![vec![2.0, 2.0], vec![5.0, 5.0]];
        assert_eq!(alpha(&same, MeasurementScale::Interval), Ok(1.0));
        let constant = vec![vec![2.0, 2.0]; 3];
        assert!(matches!(alpha(&constant, MeasurementScale::Nominal), Err(StatisticsError::NoSpread { .. })));
        let lone = vec![vec![2.0], vec![1.0]];
        assert!(matches!(alpha(&lone, MeasurementScale::Nominal), Err(StatisticsError::TooFew { .. })));
        assert!(alpha(&[], MeasurementScale::Ordinal).is_err());
        assert!(alpha(&[vec![f64::NAN, 1.0]], MeasurementScale::Ordinal).is_err());
    }
}
