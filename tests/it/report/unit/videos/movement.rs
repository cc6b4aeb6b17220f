//! Tests of `orator_report::videos::movement`.

use ndarray::Array3;
use orator_base::types::interval::Interval;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_WRIST, N_JOINTS, R_WRIST};
use orator_base::types::time::FrameRate;
use orator_report::videos::movement::MovementCounts;

#[test]
fn positions_and_speed_of_a_wrist_are_measured() {
    let fps = FrameRate::new(10, 1);
    let mut joints = Array3::zeros((10, N_JOINTS, 3));
    (0..10).for_each(|t| joints[[t, L_WRIST, 0]] = t as f32 * 0.1);
    joints[[3, R_WRIST, 2]] = f32::NAN;
    let mut movement = MovementCounts::new();
    let intervals = [Interval { start: 0, end: 6 }, Interval { start: 8, end: 99 }];
    movement.add(&Motion::from_joints(fps, joints), &intervals);
    let [left, right] = &movement.pairs[1];
    let [lowest, _, median, _, highest] = left.marks(0);
    assert!(lowest == 0.0 && (highest - 0.5).abs() < 1e-6 && (median - 0.2).abs() < 0.01, "{median}");
    assert!((left.speeds.quantile(0.5) - 1.0).abs() < 0.05);
    assert_eq!((left.speeds.total(), right.speeds.total(), movement.n_frames), (5, 3, 6));
    assert!(MovementCounts::new().pairs[0][0].marks(2)[0].is_nan());
}
