//! Fréchet distances compared with golden values.

use ndarray::{Array2, Array3, s};
use orator_base::types::skeleton::N_JOINTS;
use orator_gesture::metrics::distribution::frechet::{GaussianFit, frechet, poses};

/// Signal of the reference script: rows [n, d] that vary together, `kind` a or b.
fn rows(n: usize, d: usize, kind: usize) -> Array2<f64> {
    let hash = |i: usize, j: usize| ((i * 7919 + j * 104_729 + kind * 611_953) % 1009) as f64 / 1009.0 - 0.5;
    Array2::from_shape_fn((n, d), |(i, j)| 10.0 * hash(i, j) + 20.0 * hash(i, j % 5 + 1000) + (kind * j) as f64 * 0.05)
}

#[test]
fn the_distance_matches_scipy() {
    let golden: serde_json::Value =
        serde_json::from_str(include_str!("../../../fixtures/reference/metrics_golden.json")).unwrap();
    for case in golden["frechet"].as_array().unwrap() {
        let number = |name: &str| case[name].as_f64().unwrap();
        let [n_a, n_b, d] = ["n_a", "n_b", "d"].map(|name| number(name) as usize);
        let (a, b) = (GaussianFit::fit(rows(n_a, d, 0).view()), GaussianFit::fit(rows(n_b, d, 1).view()));
        let expected = number("distance");
        for found in [frechet(&a, &b), frechet(&b, &a)] {
            assert!((found - expected).abs() < 1e-6 * expected, "{case}: {found}");
        }
    }
}

#[test]
fn a_set_has_no_distance_from_itself_and_parts_add_up() {
    let all = rows(200, 30, 1);
    let whole = GaussianFit::fit(all.view());
    assert!(frechet(&whole, &whole) < 1e-5);
    let mut parts = GaussianFit::fit(all.slice(s![..1, ..]));
    parts += &GaussianFit::fit(all.slice(s![1..1, ..]));
    parts += &GaussianFit::fit(all.slice(s![1..77, ..]));
    parts += &GaussianFit::fit(all.slice(s![77.., ..]));
    assert_eq!(parts.n, 200);
    let near = |a: &Array2<f64>, b: &Array2<f64>| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
    assert!(near(&parts.covariance(), &whole.covariance()));
    assert!((&parts.mean - &whole.mean).iter().all(|v| v.abs() < 1e-12));
    assert!(frechet(&whole, &GaussianFit::fit(all.slice(s![..0, ..]))).is_nan());
}

#[test]
fn only_completely_visible_poses_count() {
    let joints = Array3::from_shape_fn((3, N_JOINTS, 3), |(t, joint, k)| (100 * t + joint + k) as f32);
    let mut mask = Array2::from_elem((3, N_JOINTS), true);
    mask[[0, 48]] = false;
    mask[[2, 7]] = false;
    let counted = orator_gesture::metrics::distribution::frechet::joints([mask.view()]);
    assert_eq!(counted.len(), 46);
    let rows = poses(joints.view(), mask.view(), &counted);
    assert_eq!(rows.shape(), [2, 138]);
    assert_eq!((rows[[0, 0]], rows[[1, 18]], rows[[1, 137]]), (10_100.0, 20_800.0, 25_000.0));
    let mut none = GaussianFit::default();
    none += &GaussianFit::fit(rows.view());
    assert_eq!(none.n, 2);
    assert_eq!(none.mean[0], 15_100.0);
    mask.column_mut(48).fill(false);
    assert_eq!(orator_gesture::metrics::distribution::frechet::joints([mask.view(), mask.view()]).len(), 45);
    assert!(orator_gesture::metrics::distribution::frechet::joints([]).is_empty());
}
