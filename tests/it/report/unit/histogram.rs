//! Unit tests of `orator_report::html::chart::histogram`.

use orator_report::html::chart::histogram::{Counts, ThresholdLine, histogram};

#[test]
fn every_value_is_counted_and_quantiles_are_right() {
    let mut counts = Counts::new(0.0, 1.0, 10);
    (0..100).for_each(|i| counts.add(f64::from(i) / 100.0));
    [f64::NAN, -3.0, 7.0].into_iter().for_each(|value| counts.add(value));
    assert_eq!((counts.total(), counts.unknown, counts.bins[0], counts.bins[9]), (102, 1, 11, 11));
    assert!((counts.quantile(0.5) - 0.45).abs() < 0.11 && counts.quantile(1.0) > 0.9);
    assert!(Counts::new(0.0, 1.0, 4).quantile(0.5).is_nan());
    let drawn = histogram("", &counts, "s", Some(ThresholdLine { value: 0.3, is_minimum: true })).to_string();
    assert_eq!((drawn.matches("\"bin\"").count(), drawn.matches("\"bin fails\"").count()), (7, 3));
    assert!(drawn.contains("at least 0.3 s"));
}
