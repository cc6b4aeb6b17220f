//! Unit tests of `orator_gesture::metrics::space::fixed_rate`.

use ndarray::{Array2, Array3};
use orator_base::types::skeleton::{L_HAND, N_JOINTS, NECK, R_WRIST};
use orator_base::types::time::FrameRate;
use orator_gesture::metrics::space::fixed_rate::{FPS, Frames, N_JOINTS_USED, joints_used};

/// Artificial motion in which every joint moves, [n, 49, 3].
pub(super) fn moving(n: usize) -> Array3<f32> {
    Array3::from_shape_fn((n, N_JOINTS, 3), |(t, joint, k)| {
        let phase = (joint * 7 + k * 3) as f32;
        0.1 * (phase + t as f32 * (0.05 + 0.01 * joint as f32)).sin() + 0.01 * joint as f32
    })
}

fn line(n: usize, per_frame: f32) -> Array3<f32> {
    Array3::from_shape_fn((n, N_JOINTS, 3), |(t, joint, k)| joint as f32 + k as f32 + t as f32 * per_frame)
}

#[test]
fn motion_is_resampled_and_relative_to_the_neck() {
    assert_eq!(joints_used().count(), N_JOINTS_USED);
    for (num, n, expected) in [(15, 31, 31), (30, 61, 31), (60, 121, 31), (25, 51, 31), (10, 21, 31), (30, 60, 30)] {
        let mut joints = line(n, 15.0 / num as f32);
        joints.slice_mut(ndarray::s![.., NECK, ..]).fill(1.0);
        let frames = Frames::new(joints.view(), Array2::from_elem((n, N_JOINTS), true).view(), FrameRate::new(num, 1));
        assert_eq!(frames.joints.shape()[0], expected, "{num} fps");
        assert!(frames.complete.iter().eq(std::iter::once(&(0..expected))), "{num} fps: {:?}", frames.complete);
        for t in 0..expected {
            let found = frames.joints[[t, R_WRIST, 1]];
            assert!((found - (3.0 + t as f32)).abs() < 1e-4, "{num} fps, frame {t}: {found}");
        }
    }
}

#[test]
fn windows_are_completely_visible() {
    let mut mask = Array2::from_elem((40, N_JOINTS), true);
    mask[[20, R_WRIST]] = false;
    mask[[5, L_HAND]] = false;
    let mut joints = line(40, 0.1);
    joints[[39, 48, 2]] = f32::NAN;
    let frames = Frames::new(joints.view(), mask.view(), FPS);
    assert_eq!(frames.complete, [0..20, 21..39]);
    assert_eq!(frames.starts(15, 4), [0, 4, 21]);
    assert_eq!(frames.starts(30, 1), [0; 0]);
    let half = Frames::new(joints.view(), mask.view(), FrameRate::new(30, 1));
    assert_eq!(half.complete, [0..10, 11..20]);
    assert!(Frames::new(line(0, 0.0).view(), Array2::default((0, N_JOINTS)).view(), FPS).complete.is_empty());
}
