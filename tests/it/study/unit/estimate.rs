//! Unit tests of `orator_study::stats::estimate`.

use orator_study::stats::estimate::{StatisticsError, StudentEstimate, holm, interval_of_draws};

#[test]
fn values_without_spread_have_no_estimate() {
    assert_eq!(StudentEstimate::of_mean(&[0.3; 7]), Err(StatisticsError::NoVariation { what: "values" }));
    assert!(matches!(StudentEstimate::of_mean(&[0.5]), Err(StatisticsError::TooFew { .. })));
    assert!(matches!(StudentEstimate::of_mean(&[0.5, f64::NAN]), Err(StatisticsError::NotFinite { .. })));
    assert!(StudentEstimate::new(0.0, 1.0, 0.0).is_err() && StudentEstimate::new(0.0, 1.0, f64::NAN).is_err());
    let estimate = StudentEstimate::new(0.0, 1.0, 5.0).unwrap();
    assert!(estimate.interval(1.0).is_err() && estimate.interval(f64::NAN).is_err());
    let normal = StudentEstimate::new(0.0, 1.0, f64::INFINITY).unwrap().interval(0.95).unwrap();
    assert!((normal.high - 1.959963984540054).abs() < 1e-12);
    assert_eq!(holm(&[]), Ok(vec![]));
    assert!(holm(&[0.2, f64::NAN]).is_err() && holm(&[1.1]).is_err());
    assert!(interval_of_draws([f64::NAN].into_iter(), 0.95).is_err());
}
