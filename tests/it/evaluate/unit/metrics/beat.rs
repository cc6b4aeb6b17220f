//! Tests of `orator_gesture::metrics::beat`.

use orator_gesture::metrics::beat::{beat_proximity, minima};

#[test]
fn minima_match_scipy() {
    let golden: serde_json::Value =
        serde_json::from_str(include_str!("../../../../../fixtures/reference/metrics_golden.json")).unwrap();
    let values: Vec<f64> = serde_json::from_value(golden["minima"]["values"].clone()).unwrap();
    for (order, expected) in golden["minima"]["of_order"].as_object().unwrap() {
        let expected: Vec<usize> = serde_json::from_value(expected.clone()).unwrap();
        assert_eq!(minima(&values, order.parse().unwrap()), expected, "order {order}");
    }
    assert!(minima(&[], 3).is_empty());
    assert!(minima(&[f64::NAN, 1.0, f64::NAN], 1).is_empty());
}

#[test]
fn nearness_is_a_gaussian_of_the_distance() {
    assert_eq!(beat_proximity(1.0, &[1.0, 3.0], 0.1), 1.0);
    assert!((beat_proximity(1.0, &[1.1], 0.1) - (-0.5f64).exp()).abs() < 1e-9);
    assert_eq!(beat_proximity(1.0, &[], 0.1), 0.0);
}
