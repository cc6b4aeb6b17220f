//! A speaker's skeleton: lengths of the arm bones, poses with these lengths as the stage `lift` writes them, and the
//! error of their projection.

use super::samples::LiftedStretch;
use orator_base::math::order::{lower_median, lower_quantile};
use orator_base::math::vec3::{self, Vec3};
use orator_base::motion::upper_body::{self, L_SHOULDER, Pose, R_SHOULDER, REFERENCE_SIZE};
use orator_base::types::skeleton::{ARMS, BODY_BONES};

/// Quantile of a bone's lifted lengths that counts as its length, as in the stage `lift`.
const QUANTILE: f64 = 0.7;
/// Half window, in frames at the network's rate, of the median of the apparent size, as in the stage `lift`.
const SIZE_FRAMES: f64 = 15.0;
/// Least depth of a projected point relative to the neck's, so that the division is defined for any output.
pub const MIN_DEPTH: f64 = 0.2;

/// Lengths of shoulders, upper arm and forearm in metres, equal on both sides, of a body of the reference size.
pub type ArmLengths = [f64; 3];

/// Entry of `ArmLengths` of each of the `BODY_BONES`.
pub const KINDS: [usize; 5] = [0, 1, 1, 2, 2];

/// Scale of each frame of `poses` (px): the median size within a second becomes the reference size. `step`: frames per
/// frame of the network.
pub fn metres_per_px(poses: &[Pose], step: f64) -> Vec<f64> {
    let sizes: Vec<f64> = poses.iter().map(upper_body::size).collect();
    let half = (SIZE_FRAMES * step).round() as usize;
    let around = |t: usize| sizes[t.saturating_sub(half)..sizes.len().min(t + half + 1)].iter().copied();
    (0..sizes.len()).map(|t| REFERENCE_SIZE / lower_median(around(t)).unwrap_or(1.0).max(1e-9)).collect()
}

/// Lengths of the arm bones over all `poses`; unlike those of a video, they are not limited to the range of adults,
/// because only their ratios are used. `None` if there are no poses.
pub fn arm_lengths<'a>(poses: impl Iterator<Item = &'a Pose>) -> Option<ArmLengths> {
    let mut lengths = [const { Vec::new() }; 3];
    for pose in poses {
        for ((a, b), kind) in BODY_BONES.into_iter().zip(KINDS) {
            lengths[kind].push(vec3::norm(vec3::sub(pose[a], pose[b])));
        }
    }
    let [shoulders, upper_arm, forearm] = lengths.map(|lengths| lower_quantile(lengths, QUANTILE));
    let lengths = [shoulders?, upper_arm?, forearm?];
    let sum: f64 = lengths.iter().sum();
    (sum > 1e-9).then(|| lengths.map(|length| length * REFERENCE_SIZE / sum))
}

/// The pose with unchanged directions of the arm bones and these lengths.
pub fn with_lengths(pose: &Pose, [shoulders, upper_arm, forearm]: &ArmLengths) -> Pose {
    let along = |from: Vec3, to: Vec3, length: f64| {
        vec3::scale(vec3::unit(vec3::sub(to, from), 1e-9).unwrap_or([0.0, 1.0, 0.0]), length)
    };
    let mut new = *pose;
    new[L_SHOULDER] = along(pose[R_SHOULDER], pose[L_SHOULDER], shoulders / 2.0);
    new[R_SHOULDER] = vec3::scale(new[L_SHOULDER], -1.0);
    for [shoulder, elbow, wrist] in ARMS {
        new[elbow] = vec3::add(new[shoulder], along(pose[shoulder], pose[elbow], *upper_arm));
        new[wrist] = vec3::add(new[elbow], along(pose[elbow], pose[wrist], *forearm));
    }
    new
}

/// Mean distance in metres (at the reference size and the neck's depth) between visible arm keypoints and the
/// projection of the lifted poses with constant bone lengths; NaN if nothing is visible.
pub fn reprojection_error(lifted: &[LiftedStretch], lengths: &ArmLengths) -> f64 {
    let (mut sum, mut n) = (0.0, 0);
    for LiftedStretch { keypoints, poses, metres_per_px, usable } in lifted {
        for &t in usable {
            let (scale, Some(neck)) = (metres_per_px[t], keypoints.neck(t)) else { continue };
            let pose = with_lengths(&poses[t], lengths);
            for joint in upper_body::ARMS {
                let Some(point) = keypoints.frames[t][joint] else { continue };
                let depth = (1.0 + pose[joint][2] / (scale * keypoints.focal_px)).max(MIN_DEPTH);
                let off = |k: usize| {
                    let projected = (pose[joint][k] / scale + neck[k]) / depth;
                    projected - (f64::from(point[k]) - keypoints.centre_px[k])
                };
                sum += off(0).hypot(off(1)) * scale;
                n += 1;
            }
        }
    }
    sum / f64::from(n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lifter::adapt::samples::KeypointStretch;
    use orator_base::motion::upper_body::BodyPoints;

    /// A body whose arms reach forward, with these lengths of its bones, and its picture.
    #[test]
    fn only_the_true_bone_lengths_have_no_reprojection_error() {
        let lengths = [0.30, 0.36, 0.24];
        let xs: [f64; 9] = [0.0, -0.2, -0.3, -0.1, 0.2, 0.3, 0.1, -0.1, 0.1];
        let mut pose: Pose =
            std::array::from_fn(|j| [xs[j], 0.1 * j as f64 * xs[j].abs(), -0.3 * ((j % 3) as f64 - 1.0)]);
        (pose[R_SHOULDER], pose[L_SHOULDER]) = ([-0.15, 0.0, 0.0], [0.15, 0.0, 0.0]);
        let pose = with_lengths(&pose, &lengths);
        let found = arm_lengths([pose].iter()).unwrap();
        assert!(found.iter().zip(lengths).all(|(found, length)| (found - length).abs() < 1e-9), "{found:?}");

        let (focal_px, neck) = (1500.0, [0.1, -0.2, 2.0]);
        let picture = |p: Vec3| {
            let [x, y, z] = vec3::add(p, neck);
            Some([x, y].map(|v| (640.0 + focal_px * v / z) as f32))
        };
        let frames: Vec<BodyPoints> = vec![pose.map(picture); 3];
        let keypoints = KeypointStretch { frames, step: 1.0, centre_px: [640.0; 2], focal_px };
        let poses = vec![pose; 3];
        let px: Vec<Pose> = poses.iter().map(|pose| pose.map(|p| vec3::scale(p, focal_px / neck[2]))).collect();
        let metres_per_px = metres_per_px(&px, 1.0);
        assert!((metres_per_px[1] - neck[2] / focal_px).abs() < 1e-9);
        let lifted = [LiftedStretch { keypoints: &keypoints, poses, metres_per_px, usable: vec![0, 2] }];
        assert!(reprojection_error(&lifted, &lengths) < 1e-5);
        assert!(reprojection_error(&lifted, &[0.36, 0.29, 0.25]) > 0.01);
        assert!(reprojection_error(&[], &lengths).is_nan());
    }
}
