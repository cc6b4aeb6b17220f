//! Unit tests of `orator_dataset::joint_stats`.

use ndarray::{Array2, Array3, s};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::time::FrameRate;
use orator_dataset::joint_stats::JointMoments;

fn motion(xs: &[f32], masked: &[usize]) -> Motion {
    let mut joints = Array3::<f32>::zeros((xs.len(), N_JOINTS, 3));
    joints.slice_mut(s![.., 1, 0]).assign(&ndarray::arr1(xs));
    joints.slice_mut(s![.., 2, ..]).fill(f32::NAN);
    let mut mask = Array2::from_elem((xs.len(), N_JOINTS), true);
    masked.iter().for_each(|t| mask[[*t, 1]] = false);
    Motion { fps: FrameRate::new(15, 1), joints, mask }
}

#[test]
fn masked_and_missing_joints_are_ignored() {
    let mut moments = JointMoments::default();
    moments.add_motion(&motion(&[1.0, 2.0, 6.0, 1000.0], &[3]));
    assert_eq!((moments.n_visible[1], moments.n_visible[2], moments.n_visible[0]), (3, 0, 4));
    assert!((moments.mean[1][0] - 3.0).abs() < 1e-12);
    assert!((moments.std()[1][0] - (14.0f64 / 3.0).sqrt()).abs() < 1e-12);
    assert_eq!((moments.min[1][0], moments.max[1][0]), (1.0, 6.0));
    assert_eq!((moments.mean[2], moments.std()[2], moments.max[2]), ([0.0; 3], [0.0; 3], [0.0; 3]));
}

#[test]
fn merged_moments_equal_those_of_all_frames() {
    let xs = [0.5, -1.0, 7.0, 7.5, 8.0, -30.0, 2.0];
    let mut all_frames = JointMoments::default();
    all_frames.add_motion(&motion(&xs, &[]));
    let mut merged = JointMoments::default();
    for part in [&xs[..2], &[], &xs[2..3], &xs[3..]] {
        let mut moments = JointMoments::default();
        moments.add_motion(&motion(part, &[]));
        merged.merge(&moments);
    }
    assert_eq!(
        (&merged.n_visible, &merged.min, &merged.max),
        (&all_frames.n_visible, &all_frames.min, &all_frames.max)
    );
    assert!((merged.mean[1][0] - all_frames.mean[1][0]).abs() < 1e-12);
    assert!((merged.std()[1][0] - all_frames.std()[1][0]).abs() < 1e-12);
}
