//! Tests of `orator_base::math::savitzky_golay`.

use orator_base::math::savitzky_golay::SavitzkyGolay;
use orator_base::math::vec3::Vec3;

fn run(half: usize, order: usize, values: &[f64]) -> Vec<f64> {
    let track: Vec<Vec3> = values.iter().map(|&v| [v, 0.0, -2.0 * v]).collect();
    let smooth = SavitzkyGolay::new(half, order).run(&track);
    assert!(smooth.iter().all(|v| v[1] == 0.0 && (v[2] + 2.0 * v[0]).abs() < 1e-12));
    smooth.into_iter().map(|v| v[0]).collect()
}

#[test]
fn results_equal_those_of_scipy_inside_and_at_the_ends() {
    let golden: serde_json::Value =
        serde_json::from_str(include_str!("../../../../../fixtures/reference/smoothing_golden.json")).unwrap();
    let numbers = |v: &serde_json::Value| v.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect::<Vec<_>>();
    let cases = golden["savitzky_golay"].as_array().unwrap();
    assert!(cases.len() >= 5);
    for case in cases {
        let (half, order) = (case["window"].as_u64().unwrap() as usize / 2, case["order"].as_u64().unwrap() as usize);
        for (found, expected) in run(half, order, &numbers(&case["input"])).iter().zip(numbers(&case["output"])) {
            assert!((found - expected).abs() < 1e-9, "window {}: {found} for {expected}", 2 * half + 1);
        }
    }
}

#[test]
fn a_cubic_is_unchanged_and_short_runs_are_accepted() {
    let cubic: Vec<f64> = (0..30).map(f64::from).map(|t| 1.0 + t - 0.2 * t * t + 0.01 * t * t * t).collect();
    for n in [0, 1, 4, 5, 8, 9, 30] {
        for (found, expected) in run(4, 3, &cubic[..n]).iter().zip(&cubic) {
            assert!((found - expected).abs() < 1e-9, "{n} frames");
        }
    }
    let noise: Vec<f64> = (0..7).map(|t| f64::from(t % 2)).collect();
    assert!(run(4, 3, &noise)[3] < 0.8 && run(4, 3, &noise[..4]) == noise[..4]);
}
