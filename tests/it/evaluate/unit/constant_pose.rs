//! Unit tests of `orator_gesture::evaluate::baseline::constant_pose`.

use ndarray::Array2;
use ndarray::{Array3, s};
use orator_base::types::skeleton::N_JOINTS;
use orator_gesture::evaluate::baseline::constant_pose::ConstantPoses;

#[test]
fn mean_and_median_follow_additions_and_subtractions() {
    let joints = Array3::from_shape_fn((101, N_JOINTS, 3), |(t, joint, k)| {
        ((t * 37 % 101) as f32).powi(2) * 1e-4 + (joint + k) as f32 * 0.001
    });
    let mut mask = Array2::from_elem((101, N_JOINTS), true);
    mask.column_mut(9).fill(false);
    let mut constant_poses = ConstantPoses::default();
    constant_poses.add(joints.view(), mask.view());
    let (mean, median) = (constant_poses.mean(), constant_poses.median());
    let values: Vec<f64> = (0..101).map(|t| f64::from(t * t) * 1e-4 + 0.005).collect();
    assert!((f64::from(mean[[5, 0]]) - values.iter().sum::<f64>() / 101.0).abs() < 1e-6);
    assert!((f64::from(median[[5, 0]]) - values[50]).abs() < 3e-4, "{}", median[[5, 0]]);
    assert!(mean[[9, 0]].is_nan() && median[[9, 2]].is_nan());
    let part = s![40.., .., ..];
    constant_poses.subtract(joints.slice(part), mask.slice(s![40.., ..]));
    let mut rest = ConstantPoses::default();
    rest.add(joints.slice(s![..40, .., ..]), mask.slice(s![..40, ..]));
    assert!((&constant_poses.mean() - &rest.mean()).iter().all(|v| v.is_nan() || v.abs() < 1e-6));
    assert!((&constant_poses.median() - &rest.median()).iter().all(|v| v.is_nan() || v.abs() < 1e-6));
}
