//! Tests of `orator_gesture::metrics::movement::cca`.

use ndarray::Array2;
use orator_gesture::metrics::distribution::moments;
use orator_gesture::metrics::movement::cca::correlation;

/// Signal of the reference script: rows [n, 2 d], the second half following the first in part.
fn rows(n: usize, d: usize, constant: bool) -> Array2<f64> {
    let hash = |i: usize, j: usize| ((12.9898 * i as f64 + 78.233 * j as f64).sin().abs() * 43_758.545_3).fract() - 0.5;
    let mut rows = Array2::from_shape_fn((n, 2 * d), |(i, j)| {
        if j < d {
            hash(i, j) + 0.3 * hash(i, 1000)
        } else {
            hash(i, j - d + 500) + 0.4 * hash(i, j - d) - 0.2 * hash(i, 1000)
        }
    });
    if constant {
        rows.column_mut(2).fill(0.7);
        let twice = rows.column(d).mapv(|v| 2.0 * v + 1.0);
        rows.column_mut(d + 1).assign(&twice);
    }
    rows
}

#[test]
fn the_correlation_matches_scikit_learn() {
    let golden: serde_json::Value =
        serde_json::from_str(include_str!("../../../../../fixtures/reference/metrics_golden.json")).unwrap();
    for case in golden["cca"].as_array().unwrap() {
        let [n, d] = ["n", "d"].map(|name| case[name].as_u64().unwrap() as usize);
        let rows = rows(n, d, case["constant"].as_bool().unwrap());
        let mut packed = vec![0.0; moments::packed_len(2 * d)];
        moments::add(rows.view(), &mut packed);
        let found = correlation(moments::read(&packed, 2 * d).unwrap().2.view(), d);
        let expected = case["correlation"].as_f64().unwrap();
        assert!((found - expected).abs() < 1e-5, "{case}: {found}");
    }
}

#[test]
fn constant_motion_has_no_correlation() {
    let mut covariance = Array2::<f64>::zeros((4, 4));
    covariance[[2, 2]] = 1.0;
    assert!(correlation(covariance.view(), 2).is_nan());
    covariance[[0, 0]] = f64::NAN;
    assert!(correlation(covariance.view(), 2).is_nan());
}
