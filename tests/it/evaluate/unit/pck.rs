//! Unit tests of `orator_gesture::metrics::position::pck`.

use ndarray::{Array2, Array3};
use orator_base::types::skeleton::N_JOINTS;
use orator_gesture::metrics::position::pck::{CorrectKeypoints, KeypointCount, PckAxes};

#[test]
fn the_radius_is_alpha_times_the_largest_extent() {
    let mut ground_truth = Array3::<f32>::zeros((1, N_JOINTS, 3));
    ground_truth[[0, 1, 2]] = 1.0;
    let mut predicted = ground_truth.clone();
    predicted[[0, 2, 0]] = 0.19;
    predicted[[0, 3, 0]] = 0.21;
    predicted[[0, 4, 0]] = 9.0;
    predicted[[0, 20, 1]] = f32::NAN;
    let mut mask = Array2::from_elem((1, N_JOINTS), true);
    mask[[0, 4]] = false;
    let mut correct = CorrectKeypoints::default();
    correct.count(PckAxes::Xyz, predicted.view(), ground_truth.view(), mask.view());
    let count = |n_correct, n| KeypointCount { n_correct, n };
    assert_eq!(correct, CorrectKeypoints { all: count(45, 47), body: count(4, 5), hands: count(39, 40) });
    // In the image plane the bounding box is a point.
    let mut flat = CorrectKeypoints::default();
    flat.count(PckAxes::Xy, predicted.view(), ground_truth.view(), mask.view());
    assert_eq!(flat.body, count(3, 5));
}
