//! Unit tests of `orator_study::stats::rank`.

use orator_study::stats::estimate::{ConfidenceInterval, StatisticsError};
use orator_study::stats::rank::{MeasurementScale, RankTest, alpha, friedman, median_interval, signed_rank};

#[test]
fn invalid_arguments_are_rejected() {
    assert!(matches!(signed_rank(&[0.0; 4]), Err(StatisticsError::TooFew { .. })));
    assert!(signed_rank(&[]).is_err() && signed_rank(&[1.0, f64::NAN]).is_err());
    assert_eq!(signed_rank(&[3.0]), Ok(RankTest { statistic: 0.0, p: 1.0 }));
    assert!(friedman(&[]).is_err() && friedman(&[vec![1.0, 2.0], vec![2.0, 1.0]]).is_err());
    assert!(friedman(&[vec![1.0, 2.0, 3.0], vec![1.0]]).is_err());
    assert!(matches!(friedman(&vec![vec![1.0; 3]; 5]), Err(StatisticsError::NoVariation { .. })));
}

#[test]
fn six_values_are_needed() {
    let six = [3.0, 1.0, 6.0, 2.0, 5.0, 4.0];
    assert_eq!(median_interval(&six, 0.95), Ok(ConfidenceInterval { low: 1.0, high: 6.0 }));
    let few = Err(StatisticsError::TooFew { what: "values", min: 6, found: 5 });
    assert_eq!(median_interval(&six[..5], 0.95), few);
    assert!(median_interval(&[], 0.95).is_err() && median_interval(&[f64::NAN; 9], 0.95).is_err());
    assert_eq!(median_interval(&[2.0; 9], 0.95), Ok(ConfidenceInterval { low: 2.0, high: 2.0 }));
}

#[test]
fn full_agreement_is_1_and_undefined_agreement_is_an_error() {
    let same = vec![vec![2.0, 2.0], vec![5.0, 5.0]];
    assert_eq!(alpha(&same, MeasurementScale::Interval), Ok(1.0));
    let constant = vec![vec![2.0, 2.0]; 3];
    assert!(matches!(alpha(&constant, MeasurementScale::Nominal), Err(StatisticsError::NoVariation { .. })));
    let lone = vec![vec![2.0], vec![1.0]];
    assert!(matches!(alpha(&lone, MeasurementScale::Nominal), Err(StatisticsError::TooFew { .. })));
    assert!(alpha(&[], MeasurementScale::Ordinal).is_err());
    assert!(alpha(&[vec![f64::NAN, 1.0]], MeasurementScale::Ordinal).is_err());
}
