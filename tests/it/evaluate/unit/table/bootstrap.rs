//! Tests of `orator_gesture::evaluate::table::bootstrap`.

use ndarray::Array1;
use orator_base::math::estimate::Estimate;
use orator_gesture::evaluate::table::bootstrap::{BlockGroups, counts, estimate};

#[test]
fn the_interval_of_a_mean_is_about_two_standard_errors_wide() {
    let values: Vec<f64> = (0..200).map(|i| f64::from(i * 7919 % 1009) / 1009.0).collect();
    let mean = values.iter().sum::<f64>() / 200.0;
    let drawn: Vec<f64> = (counts(200, 1000).dot(&Array1::from(values.clone())) / 200.0).to_vec();
    let Estimate { value, interval } = estimate(mean, &drawn);
    let variance = values.iter().map(|v| (v - value).powi(2)).sum::<f64>() / 200.0;
    let expected = 2.0 * 1.96 * (variance / 200.0).sqrt();
    let width = interval.high - interval.low;
    assert!((width / expected - 1.0).abs() < 0.1, "{width} {expected}");
    assert!(interval.low < value && value < interval.high && interval.excludes_zero());
    let none = orator_gesture::evaluate::table::bootstrap::estimate(1.0, &[f64::NAN]);
    assert!(none.value == 1.0 && none.interval.low.is_nan() && !none.interval.excludes_zero());
}

#[test]
fn contributions_to_a_mean_are_the_sums_of_the_groups() {
    let frames = [30, 30, 10, 20, 45];
    let sums = [3.0, -2.0, 7.0, 0.5, 1.0];
    let groups = BlockGroups::new(&frames);
    let mean = |counts: &[f64]| {
        let total = |of: &dyn Fn(usize) -> f64| (0..5).map(|k| counts[k] * of(k)).sum::<f64>();
        total(&|k| sums[k]) / total(&|k| frames[k] as f64)
    };
    let without: Vec<f64> = groups.counts_without().outer_iter().map(|row| mean(&row.to_vec())).collect();
    let found = groups.contributions(mean(&[1.0; 5]), &without);
    for (found, sum) in found.iter().zip(sums) {
        assert!((found - 5.0 * sum / 135.0).abs() < 1e-12, "{found}");
    }
}

#[test]
fn many_blocks_are_merged() {
    let groups = BlockGroups::new(&[60; 900]);
    assert_eq!((groups.len(), groups.counts_without().dim()), (32, (32, 900)));
    assert!(groups.shares.iter().all(|share| (share - 1.0 / 32.0).abs() < 2e-3));
    assert!(groups.counts_without().column(899).iter().sum::<f64>() == 31.0);
    assert!(BlockGroups::new(&[]).is_empty() && BlockGroups::new(&[]).contributions(1.0, &[]).is_empty());
}
