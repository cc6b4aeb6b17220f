//! Smoothing with a Gaussian.

use ndarray::Array3;
use orator_base::math::gaussian::gaussian;

fn smoothed(values: &[f32], sigma: f64) -> Vec<f32> {
    let mut tracks = Array3::from_shape_fn((values.len(), 1, 1), |(t, _, _)| values[t]);
    gaussian(tracks.view_mut(), sigma);
    tracks.into_raw_vec_and_offset().0
}

#[test]
fn the_impulse_response_is_the_gaussian() {
    let mut pulse = [0.0; 21];
    pulse[10] = 1.0;
    let out = smoothed(&pulse, 1.0);
    let sum: f64 = (-3i32..=3).map(|d| (-0.5 * f64::from(d * d)).exp()).sum();
    for d in 0..=3i32 {
        let expected = ((-0.5 * f64::from(d * d)).exp() / sum) as f32;
        assert!((out[(10 + d) as usize] - expected).abs() < 1e-6);
        assert_eq!(out[(10 + d) as usize], out[(10 - d) as usize]);
    }
}

#[test]
fn linear_motion_is_exact_up_to_the_ends_and_gaps_separate() {
    let nan = f32::NAN;
    let line = [0.0, 1.0, 2.0, 3.0, nan, 40.0, 42.0, 44.0, nan, 7.0];
    let out = smoothed(&line, 2.0);
    for (a, b) in line.iter().zip(&out) {
        assert!(a.is_nan() && b.is_nan() || (a - b).abs() < 1e-5, "{a} {b}");
    }
    assert_eq!(smoothed(&line[..4], 0.0), line[..4]);
    assert_eq!(smoothed(&[], 1.0), Vec::<f32>::new());
}

#[test]
fn noise_is_attenuated() {
    let noisy: Vec<f32> = (0..200).map(|t| if t % 2 == 0 { 1.0 } else { -1.0 }).collect();
    assert!(smoothed(&noisy, 1.0)[5..195].iter().all(|v| v.abs() < 0.05));
}
