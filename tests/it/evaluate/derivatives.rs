//! Derivatives of motion.

use ndarray::{Array2, Array3};
use orator_base::types::skeleton::{L_HAND, N_JOINTS, R_WRIST};
use orator_base::types::time::FrameRate;
use orator_gesture::metrics::movement::derivatives::MotionEnergy;

#[test]
fn steady_motion_has_the_square_of_its_speed() {
    // The right wrist moves at 0.3 m/s along x and 0.4 m/s along z. The left hand root, not counted, jumps.
    let joints = Array3::from_shape_fn((4, N_JOINTS, 3), |(t, joint, k)| match (joint, k) {
        (R_WRIST, 0) => 0.3 * t as f32 / 15.0,
        (R_WRIST, 2) => 0.4 * t as f32 / 15.0,
        (L_HAND, _) => t as f32,
        _ => 1.0,
    });
    let mut mask = Array2::from_elem((4, N_JOINTS), true);
    let fps = FrameRate::new(15, 1);
    let mut whole = MotionEnergy::default();
    whole.add(joints.view(), mask.view(), fps);
    assert_eq!(whole.n, 3 * 46);
    assert!((whole.mean() - 0.25 / 46.0).abs() < 1e-6);
    mask[[1, R_WRIST]] = false;
    let mut gap = MotionEnergy::default();
    gap.add(joints.view(), mask.view(), fps);
    assert_eq!(gap.n, 3 * 46 - 2);
    assert!((gap.sum - 0.25).abs() < 1e-6);
    assert!((gap.relative_to(&whole) - (0.25 / 136.0) / (0.25 / 46.0)).abs() < 1e-6);
    assert!(whole.relative_to(&MotionEnergy::default()).is_nan());
}
