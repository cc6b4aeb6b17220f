//! Motion at other frame rates.

use ndarray::Array3;
use orator_base::motion::resample::at_rate;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::N_JOINTS;
use orator_base::types::time::FrameRate;
use std::f64::consts::TAU;

/// Joint 1 oscillates along x at `hz` for `secs` seconds.
fn swing(fps: FrameRate, secs: f64, hz: f64) -> Motion {
    let n = (secs * fps.per_sec()).round() as usize;
    let joints = Array3::from_shape_fn((n, N_JOINTS, 3), |(t, j, k)| {
        if j == 1 && k == 0 { (TAU * hz * fps.secs(t)).sin() as f32 } else { 0.0 }
    });
    Motion::from_joints(fps, joints)
}

/// Maximum amplitude in the middle of the resampled motion, and maximum deviation from the original oscillation.
fn measured(from: (u32, u32), to: u32, hz: f64) -> (f64, f64) {
    let motion = at_rate(&swing(FrameRate::new(from.0, from.1), 8.0, hz), FrameRate::new(to, 1));
    let middle = motion.n_frames() / 4..motion.n_frames() * 3 / 4;
    let value = |t: usize| f64::from(motion.joints[[t, 1, 0]]);
    let truth = |t: usize| (TAU * hz * motion.fps.secs(t)).sin();
    let largest = |of: &dyn Fn(usize) -> f64| middle.clone().map(of).fold(0.0, f64::max);
    (largest(&|t| value(t).abs()), largest(&|t| (value(t) - truth(t)).abs()))
}

#[test]
fn slow_motion_is_exact_and_fast_motion_does_not_alias() {
    for from in [(20, 1), (30, 1), (60, 1), (120, 1), (30_000, 1001)] {
        for hz in [0.5, 2.0, 4.0] {
            let (_, off) = measured(from, 15, hz);
            assert!(off < 3e-3, "{from:?} {hz} Hz: off by {off}");
        }
    }
    for (from, hz) in
        [((20, 1), 9.5), ((30, 1), 10.0), ((60, 1), 8.5), ((60, 1), 12.0), ((60, 1), 14.9), ((120, 1), 30.0)]
    {
        let (left, _) = measured(from, 15, hz);
        assert!(left < 3e-3, "{from:?} {hz} Hz: {left} is left");
    }
    let (_, off) = measured((10, 1), 15, 2.0);
    assert!(off < 3e-3, "upwards: {off}");
}

#[test]
fn linear_motion_is_exact_up_to_its_ends_and_of_equal_duration() {
    for (from, n, to, expected) in
        [(60, 241, 15, 61), (30, 60, 15, 30), (20, 40, 15, 30), (15, 33, 15, 33), (30, 1, 15, 1)]
    {
        let fps = FrameRate::new(from, 1);
        let joints = Array3::from_shape_fn((n, N_JOINTS, 3), |(t, j, k)| (fps.secs(t) * j as f64 + k as f64) as f32);
        let moved = at_rate(&Motion::from_joints(fps, joints), FrameRate::new(to, 1));
        assert_eq!(moved.n_frames(), expected, "{from} to {to}");
        for ((t, j, k), &v) in moved.joints.indexed_iter() {
            let truth = moved.fps.secs(t) * j as f64 + k as f64;
            assert!((f64::from(v) - truth).abs() < 1e-6 * truth.max(1.0), "{from} to {to}, frame {t}: {v} {truth}");
        }
    }
}

#[test]
fn a_gap_remains_a_gap_and_does_not_affect_other_frames() {
    let mut motion = swing(FrameRate::new(60, 1), 4.0, 1.0);
    motion.joints.slice_mut(ndarray::s![100..140, 2, ..]).fill(f32::NAN);
    motion.mask.slice_mut(ndarray::s![100..140, 2]).fill(false);
    motion.mask.slice_mut(ndarray::s![8..13, 3]).fill(false);
    let moved = at_rate(&motion, FrameRate::new(15, 1));
    for t in 0..moved.n_frames() {
        assert_eq!(moved.joints[[t, 2, 0]].is_nan(), (25..35).contains(&t), "frame {t}");
        assert_eq!(moved.mask[[t, 2]], !(25..35).contains(&t));
        assert_eq!(moved.mask[[t, 3]], !(2..4).contains(&t), "frame {t}");
        assert!(moved.joints[[t, 1, 0]].is_finite() && moved.mask[[t, 1]]);
    }
}
