//! Tests of `orator_gesture::evaluate::table::sign_flips`.

use orator_gesture::evaluate::table::sign_flips::{LEVEL, MAX_EXACT, MIN_BLOCKS, test};
use rand::{RngCore, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[test]
fn p_values_match_scipy() {
    let golden: serde_json::Value =
        serde_json::from_str(include_str!("../../../../../fixtures/reference/verdict_golden.json")).unwrap();
    for case in golden["sign_flips"].as_array().unwrap() {
        let differences: Vec<Vec<f64>> = serde_json::from_value(case["differences"].clone()).unwrap();
        let expected: Vec<f64> = serde_json::from_value(case["p"].clone()).unwrap();
        let exact = differences[0].len() <= MAX_EXACT;
        for (found, p) in test(&differences, 1.0).iter().zip(expected) {
            // Four standard deviations of the random flips.
            let bound = if exact { 1e-12 } else { 4.0 * (p * (1.0 - p) / 1e4).sqrt() + 1e-4 };
            assert!((found.p - p).abs() <= bound, "{} {p}", found.p);
        }
    }
}

#[test]
fn the_interval_agrees_with_the_test() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut number = || f64::from(rng.next_u32()) / f64::from(u32::MAX) - 0.5;
    let mut n_rejected = 0;
    for case in 0..300 {
        let (n, shift) = (5 + case % 9, f64::from(case as u32 % 7) * 0.1);
        let metrics: Vec<Vec<f64>> = (0..3).map(|_| (0..n).map(|_| number() + shift).collect()).collect();
        for tested in test(&metrics, 1.0 + f64::from(case as u32 % 4) * 0.2) {
            assert!(tested.mean.interval.low <= tested.mean.value && tested.mean.value <= tested.mean.interval.high);
            assert_eq!(tested.p <= LEVEL, tested.mean.interval.excludes_zero(), "{tested:?}");
            assert!(n >= MIN_BLOCKS || tested.p > LEVEL, "{tested:?}");
            n_rejected += usize::from(tested.p <= LEVEL);
        }
    }
    assert!((100..800).contains(&n_rejected), "{n_rejected}");
}

#[test]
fn extreme_inputs_have_valid_p_values() {
    let alike = test(&[vec![0.2; MIN_BLOCKS]], 1.0)[0];
    assert!(alike.p == 2.0 / 128.0 && alike.mean.interval.excludes_zero(), "{alike:?}");
    assert!(!test(&[vec![0.2; MIN_BLOCKS - 1]], 1.0)[0].mean.interval.excludes_zero());
    assert_eq!(test(&[vec![0.0; 9]], 1.0)[0].p, 1.0);
    let broken = test(&[vec![f64::NAN; 9], vec![1e300; 9], vec![]], 1.0);
    assert!(broken.iter().all(|tested| tested.p == 1.0), "{broken:?}");
    assert!(test(&[], 1.0).is_empty());
    let many = test(&[vec![1.0; 40]], 1.0)[0];
    assert_eq!((many.p, many.mean.interval.low), (1e-4, 1.0));
}
