//! Cepstral coefficients compared with golden values.

use ndarray::Array2;
use orator_base::audio::mfcc::{N_CEPSTRA, mfcc, n_poses, of_poses, silence, with_context};
use std::f64::consts::PI;

#[test]
fn coefficients_equal_those_of_python_speech_features() {
    let golden: serde_json::Value =
        serde_json::from_str(include_str!("../../../fixtures/reference/audio_features_golden.json")).unwrap();
    for case in golden["mfcc"].as_array().unwrap() {
        let rate = case["rate"].as_u64().unwrap() as u32;
        let sample = |i: usize| {
            let t = i as f64 / f64::from(rate);
            (0.4 * (2.0 * PI * (200.0 + 300.0 * t) * t).sin() * (1.0 + (11.0 * t).cos()) / 2.0
                + 0.05 * (2.0 * PI * 2900.0 * t).sin()) as f32
        };
        let sound: Vec<f32> = (0..case["n_samples"].as_u64().unwrap() as usize).map(sample).collect();
        let check = |found: Array2<f64>, name: &str| {
            let known: Vec<Vec<f64>> = serde_json::from_value(case[name].clone()).unwrap();
            assert_eq!(found.nrows(), known.len());
            for (found, known) in found.iter().zip(known.iter().flatten()) {
                assert!((found - known).abs() < 1e-3 * (1.0 + known.abs()), "{name} {rate}: {found} {known}");
            }
        };
        check(mfcc(&sound, rate), "cepstra");
        check(of_poses(&sound, rate, 20.0, case["at_20_fps"].as_array().unwrap().len()), "at_20_fps");
    }
    assert_eq!(mfcc(&[], 16_000).nrows(), 0);
    assert!(of_poses(&[], 16_000, 20.0, 3).iter().all(|v| *v == 0.0));
    assert!(mfcc(&[0.0; 10], 16_000).iter().all(|v| v.is_finite()));
}

#[test]
fn poses_at_another_rate_share_the_rows_at_their_edges() {
    let sound: Vec<f32> = (0..16_000).map(|i| 0.3 * (i as f32 * 0.2).sin() * (i as f32 * 0.0007).cos()).collect();
    let (rows, poses) = (mfcc(&sound, 16_000), of_poses(&sound, 16_000, 15.0, n_poses(16_000, 16_000, 15.0)));
    assert_eq!(poses.nrows(), 15);
    // Pose 1 covers rows 6 2/3 to 13 1/3.
    let complete: f64 = (7..13).map(|row| rows[[row, 3]]).sum();
    let known = (complete + rows[[6, 3]] / 3.0 + rows[[13, 3]] / 3.0) * 3.0 / 20.0;
    assert!((poses[[1, 3]] - known).abs() < 1e-9, "{} {known}", poses[[1, 3]]);
    let silence = silence(16_000);
    let padded = with_context(&poses, 7, &silence);
    assert_eq!(padded.dim(), (21, N_CEPSTRA));
    assert!(padded[[2, 0]] == silence[0] as f32 && padded[[3, 0]] == poses[[0, 0]] as f32);
    assert!(padded[[20, 5]] == silence[5] as f32 && silence.iter().all(|v| v.is_finite()));
}
