//! Bone lengths of a motion: robust measurement, and scaling of a motion to given lengths.

use crate::math::order::lower_median;
use crate::types::pose3d::Motion;
use crate::types::skeleton::{L_HAND, N_BONES, N_JOINTS, NECK, R_HAND, parent};

/// Measures one length per bone in metres: the median over the frames where both of its ends were visible (mask true),
/// otherwise over the frames where both exist. Bone `joint - 1` is the one from the parent to `joint`. The result is 0
/// for a bone that never exists, and for the two hand roots, which duplicate the wrists.
pub fn measure(motion: &Motion) -> [f32; N_BONES] {
    let mut lengths = [0.0; N_BONES];
    for joint in 1..N_JOINTS {
        let Some(parent) = parent(joint) else { continue };
        if joint == L_HAND || joint == R_HAND {
            continue;
        }
        let over = |seen_only: bool| {
            let frames =
                (0..motion.n_frames()).filter(|&t| !seen_only || (motion.mask[[t, joint]] && motion.mask[[t, parent]]));
            lower_median(frames.map(|t| length(at(motion, t, parent), at(motion, t, joint))))
        };
        lengths[joint - 1] = over(true).or_else(|| over(false)).unwrap_or(0.0);
    }
    lengths
}

/// Sets the length of every bone: each joint is moved along its direction from its parent, from the neck outwards,
/// with the neck at 0. A length of 0 (not measured) leaves the bone unchanged. The hand roots become equal to the
/// wrists. A missing joint (NaN) stays missing, and the children of a missing joint become missing.
pub fn with_lengths(motion: &mut Motion, lengths: &[f32; N_BONES]) {
    for t in 0..motion.n_frames() {
        let before: [[f32; 3]; N_JOINTS] = std::array::from_fn(|j| at(motion, t, j));
        let mut after = [[f32::NAN; 3]; N_JOINTS];
        if before[NECK].iter().all(|v| v.is_finite()) {
            after[NECK] = [0.0; 3];
        }
        for joint in 1..N_JOINTS {
            let Some(parent) = parent(joint) else { continue };
            let own = length(before[parent], before[joint]);
            let hand_root = joint == L_HAND || joint == R_HAND;
            after[joint] = match lengths[joint - 1] {
                _ if hand_root => after[parent],
                _ if !own.is_finite() => [f32::NAN; 3],
                target if target > 0.0 && own > 1e-9 => {
                    let grow = target / own;
                    std::array::from_fn(|k| after[parent][k] + (before[joint][k] - before[parent][k]) * grow)
                }
                // The bone has no direction: the joint hangs straight down.
                target if target > 0.0 => [after[parent][0], after[parent][1] + target, after[parent][2]],
                _ => std::array::from_fn(|k| after[parent][k] + before[joint][k] - before[parent][k]),
            };
        }
        for (joint, position) in after.iter().enumerate() {
            let exists = position.iter().all(|v| v.is_finite());
            motion.mask[[t, joint]] &= exists;
            for (k, &v) in position.iter().enumerate() {
                motion.joints[[t, joint, k]] = if exists { v } else { f32::NAN };
            }
        }
    }
}

fn at(motion: &Motion, t: usize, joint: usize) -> [f32; 3] {
    std::array::from_fn(|k| motion.joints[[t, joint, k]])
}

fn length(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).map(|k| (b[k] - a[k]).powi(2)).sum::<f32>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::types::skeleton::{L_WRIST, R_ELBOW, R_SHOULDER, R_WRIST};
    use crate::types::time::FrameRate;
    use ndarray::{Array2, Array3, s};

    /// Five frames; joint j lies at its parent + (0.01 j, 0.02, 0), and all bones of frame 4 are twice as long.
    fn motion() -> Motion {
        let mut joints = Array3::zeros((5, N_JOINTS, 3));
        for t in 0..5 {
            for j in 1..N_JOINTS {
                let p = parent(j).unwrap();
                let grow = if t == 4 { 2.0 } else { 1.0 };
                let step =
                    if j == L_HAND || j == R_HAND { [0.0; 3] } else { [0.01 * j as f32 * grow, 0.02 * grow, 0.0] };
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
                    let ratio = (m.joints[[t, j, 0]] - m.joints[[t, p, 0]])
                        / (before.joints[[t, j, 0]] - before.joints[[t, p, 0]]);
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
}
