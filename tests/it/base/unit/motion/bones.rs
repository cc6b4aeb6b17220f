//! Tests of `orator_base::motion::bones`.

use ndarray::{Array2, Array3, s};
use orator_base::motion::bones::{measure, with_lengths};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_HAND, L_WRIST, N_BONES, N_JOINTS, R_ELBOW, R_HAND, R_SHOULDER, R_WRIST, parent};
use orator_base::types::time::FrameRate;

fn at(motion: &Motion, t: usize, joint: usize) -> [f32; 3] {
    std::array::from_fn(|k| motion.joints[[t, joint, k]])
}

fn length(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).map(|k| (b[k] - a[k]).powi(2)).sum::<f32>().sqrt()
}

/// Five frames; joint j lies at its parent + (0.01 j, 0.02, 0), and all bones of frame 4 are twice as long.
fn motion() -> Motion {
    let mut joints = Array3::zeros((5, N_JOINTS, 3));
    for t in 0..5 {
        for j in 1..N_JOINTS {
            let p = parent(j).unwrap();
            let grow = if t == 4 { 2.0 } else { 1.0 };
            let step = if j == L_HAND || j == R_HAND { [0.0; 3] } else { [0.01 * j as f32 * grow, 0.02 * grow, 0.0] };
            (0..3).for_each(|k| joints[[t, j, k]] = joints[[t, p, k]] + step[k]);
        }
    }
    Motion { fps: FrameRate::new(15, 1), joints, mask: Array2::from_elem((5, N_JOINTS), true) }
}

#[test]
fn the_median_ignores_outliers_and_hidden_frames() {
    let mut m = motion();
    let lengths = measure(&m);
    let expected = (0.03f32.powi(2) + 0.02f32.powi(2)).sqrt();
    assert!((lengths[R_WRIST - 1] - expected).abs() < 1e-6);
    assert_eq!((lengths[L_HAND - 1], lengths[R_HAND - 1]), (0.0, 0.0));
    m.mask.slice_mut(s![..4, R_WRIST]).fill(false);
    assert!((measure(&m)[R_WRIST - 1] - 2.0 * expected).abs() < 1e-6);
}

#[test]
fn lengths_become_exact_and_directions_and_nan_are_preserved() {
    let mut m = motion();
    m.joints.slice_mut(s![2, R_ELBOW, ..]).fill(f32::NAN);
    let before = m.clone();
    let lengths = measure(&before).map(|l| l * 1.5);
    with_lengths(&mut m, &lengths);
    for t in 0..5 {
        assert_eq!(m.joints.slice(s![t, L_HAND, ..]), m.joints.slice(s![t, L_WRIST, ..]));
        for j in 1..N_JOINTS {
            let below_gap = t == 2 && ((R_ELBOW..=R_WRIST).contains(&j) || j >= R_HAND);
            assert_eq!(m.joints[[t, j, 0]].is_nan(), below_gap, "frame {t} joint {j}");
            assert_eq!(m.mask[[t, j]], !below_gap);
            let p = parent(j).unwrap();
            if !below_gap && lengths[j - 1] > 0.0 {
                assert!((length(at(&m, t, p), at(&m, t, j)) - lengths[j - 1]).abs() < 1e-6);
                let ratio =
                    (m.joints[[t, j, 0]] - m.joints[[t, p, 0]]) / (before.joints[[t, j, 0]] - before.joints[[t, p, 0]]);
                assert!(ratio > 0.0);
            }
        }
    }
    assert!((m.joints[[0, R_SHOULDER, 0]] - 0.015).abs() < 1e-6);
}

#[test]
fn an_unmeasured_bone_and_an_empty_motion_are_unchanged() {
    let mut m = motion();
    let before = m.clone();
    with_lengths(&mut m, &[0.0; N_BONES]);
    assert!((&m.joints - &before.joints).iter().all(|d| d.abs() < 1e-6));
    let mut empty = Motion { joints: Array3::zeros((0, N_JOINTS, 3)), mask: Array2::default((0, N_JOINTS)), ..m };
    assert_eq!(measure(&empty), [0.0; N_BONES]);
    with_lengths(&mut empty, &[1.0; N_BONES]);
}
