//! Checks of a sample: matching shapes, joints present where the mask is set, constant bone lengths, values in range.

use crate::sample::Sample;
use anyhow::{Result, ensure};
use orator_base::types::posture::PostureChannel;
use orator_base::types::skeleton::{L_HAND, N_JOINTS, NECK, R_HAND, parent};

/// Largest deviation of a bone from its length, metres: float32 rounding half a metre from the neck.
const BONE_TOLERANCE: f64 = 1e-5;
/// Largest angle of head or trunk, radians: half a turn plus rounding.
const MAX_RADIANS: f32 = std::f32::consts::PI + 1e-4;

/// Checks a sample; `lengths` are the bone lengths of its video (metres; 0: not measured).
///
/// # Errors
/// The first inconsistency, with its frame and joint.
pub fn check_sample(sample: &Sample, lengths: &[f64]) -> Result<()> {
    // Encoding checks the shapes.
    sample.members()?;
    sample.optional_members()?;
    let (joints, mask) = (&sample.motion.joints, &sample.motion.mask);
    for t in 0..sample.n_frames() {
        let at = |joint: usize| -> [f64; 3] { std::array::from_fn(|k| f64::from(joints[[t, joint, k]])) };
        for joint in 0..N_JOINTS {
            let position = at(joint);
            let finite = position.iter().all(|v| v.is_finite());
            ensure!(finite || position.iter().all(|v| v.is_nan()), "frame {t}: joint {joint} is {position:?}");
            ensure!(finite || !mask[[t, joint]], "frame {t}: joint {joint} is missing, but visible in the mask");
            ensure!(!finite || position.iter().all(|v| v.abs() < 10.0), "frame {t}: joint {joint} is {position:?}");
            let (Some(parent), Some(&length)) =
                (parent(joint), joint.checked_sub(1).and_then(|bone| lengths.get(bone)))
            else {
                continue;
            };
            let measured = distance(at(parent), position);
            if !measured.is_finite() {
                continue;
            }
            let root = joint == L_HAND || joint == R_HAND;
            let expected = if root { 0.0 } else { length };
            ensure!(
                (!root && length == 0.0) || (measured - expected).abs() < BONE_TOLERANCE,
                "frame {t}: the bone to joint {joint} is {measured:.6} m, the video's is {expected:.6} m"
            );
        }
        ensure!(at(NECK) == [0.0; 3] || at(NECK)[0].is_nan(), "frame {t}: the neck is not the origin");
    }
    for channel in PostureChannel::ALL {
        for ((t, _), angle) in sample.posture.iter().flat_map(|posture| posture.channel(channel).indexed_iter()) {
            let is_angle = angle.is_nan() || angle.abs() <= MAX_RADIANS;
            ensure!(is_angle, "frame {t}: an angle of the {} is {angle} radians", channel.name());
        }
    }
    let scores = sample.pose2d.index_axis(ndarray::Axis(2), 2);
    ensure!(sample.pose2d.iter().all(|v| v.is_finite()), "a keypoint is not finite");
    ensure!(scores.iter().all(|score| (-1e-6..=1.0 + 1e-3).contains(score)), "a keypoint's score is not in 0..1");
    Ok(())
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}
