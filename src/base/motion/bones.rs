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
