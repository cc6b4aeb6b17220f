//! Depth of hands.

use ndarray::{Array3, s};
use orator_pipeline::lift::hand_depth::resolve;

/// A slowly rotating hand with points up to 0.2 deep.
fn turning(n_frames: usize) -> Array3<f32> {
    Array3::from_shape_fn((n_frames, 21, 3), |(t, j, k)| {
        let angle = 0.3 + 0.01 * t as f32;
        0.01 * j as f32 * [0.4, -angle.cos(), -angle.sin()][k]
    })
}

fn resolved(mut track: Array3<f32>) -> Array3<f32> {
    resolve(track.view_mut(), None, 1.0 / 15.0);
    track
}

#[test]
fn incorrectly_mirrored_hands_are_corrected() {
    let truth = turning(60);
    assert_eq!(resolved(truth.clone()), truth);
    let mut wrong = truth.clone();
    for t in [0, 7, 20, 21, 22, 23, 40, 59] {
        wrong.slice_mut(s![t, .., 2]).mapv_inplace(|z| -z);
    }
    wrong.slice_mut(s![30..33, .., ..]).fill(f32::NAN);
    let mut expected = truth;
    expected.slice_mut(s![30..33, .., ..]).fill(f32::NAN);
    assert!(resolved(wrong).iter().zip(&expected).all(|(a, b)| a == b || a.is_nan() && b.is_nan()));
}

#[test]
fn the_majority_of_the_lifter_output_is_retained() {
    let mut wrong = turning(60);
    wrong.slice_mut(s![..50, .., 2]).mapv_inplace(|z| -z);
    let resolved = resolved(wrong.clone());
    assert_eq!(resolved.slice(s![..50, .., ..]), wrong.slice(s![..50, .., ..]));
    assert_eq!(resolved[[55, 20, 2]], -wrong[[55, 20, 2]]);
    resolve(Array3::zeros((0, 21, 3)).view_mut(), None, 0.1);
    let truth = turning(60);
    let mut wrong = truth.mapv(|v| v);
    wrong.slice_mut(s![.., .., 2]).mapv_inplace(|z| -z);
    let model_depth = truth.slice(s![.., .., 2]).mapv(|z| 50.0 * z);
    resolve(wrong.view_mut(), Some(model_depth.view()), 1.0 / 15.0);
    assert_eq!(wrong, truth, "the hand model decides");
}
