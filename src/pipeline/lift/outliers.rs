//! Errors revealed by lifting: frames with bone lengths far from those in the rest of the video (a wrong keypoint,
//! another person's arm), and frames with joints that stay missing. `reject` removes them from intervals and ledger.

use super::lengths::bone;
use super::reject::{bone_rejections, exceeds};
use ndarray::{Array2, s};
use orator_base::math::order::lower_median;
use orator_base::stage::rejection::{FrameRejection, Rejection};
use orator_base::types::interval::Interval;
use orator_base::types::pose2d::{Keypoints, coco};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::BODY_BONES;

/// Keypoints at the ends of `BODY_BONES`.
const POINTS: [(usize, usize); 5] = [
    (coco::R_SHOULDER, coco::L_SHOULDER),
    (coco::R_SHOULDER, coco::R_ELBOW),
    (coco::L_SHOULDER, coco::L_ELBOW),
    (coco::R_ELBOW, coco::R_WRIST),
    (coco::L_ELBOW, coco::L_WRIST),
];

/// Deviation of the bone lengths in each frame from those of the video.
pub struct BoneChange {
    /// Length in the frame divided by the bone's median in the video, minus 1, [T, 5]; NaN if an end is not visible.
    changes: Array2<f32>,
}

impl BoneChange {
    /// Measures bones as lifted, before one length per bone is applied.
    pub fn measure(raw: &Motion) -> Self {
        let mut changes = Array2::from_elem((raw.n_frames(), BODY_BONES.len()), f32::NAN);
        for (i, (from, to)) in BODY_BONES.into_iter().enumerate() {
            let is_visible = |t: usize| raw.mask[[t, from]] && raw.mask[[t, to]];
            let length = |t: usize| if is_visible(t) { bone(raw, t, from, to) } else { f32::NAN };
            let lengths: Vec<f32> = (0..raw.n_frames()).map(length).collect();
            let median_length = lower_median(lengths.iter().copied()).unwrap_or(f32::NAN);
            changes
                .column_mut(i)
                .iter_mut()
                .zip(lengths)
                .for_each(|(change, length)| *change = length / median_length - 1.0);
        }
        Self { changes }
    }

    /// Largest absolute deviation in each frame, [T]; NaN if no bone is visible.
    pub fn largest(&self) -> Vec<f32> {
        self.changes
            .outer_iter()
            .map(|bones| bones.iter().map(|change| change.abs()).fold(f32::NAN, f32::max))
            .collect()
    }

    /// Rejects the frames of runs longer than `max_gap` in which a bone deviates by more than `most`. In shorter runs
    /// the ends of such bones are hidden in `keypoints`, so that lifting fills them.
    pub fn judge(&self, most: f64, max_gap: usize, keypoints: &mut Keypoints) -> Vec<Option<FrameRejection>> {
        let rejections = bone_rejections(&self.largest(), most, max_gap);
        for (changes, t) in self.changes.outer_iter().zip(0..).filter(|(_, t)| rejections[*t].is_none()) {
            for (&change, (from, to)) in changes.iter().zip(POINTS) {
                if exceeds(change, most) {
                    for point in [from, to] {
                        keypoints.body[[t, point, 2]] = 0.0;
                    }
                }
            }
        }
        rejections
    }

    /// Whether any bone deviates by more than `most`.
    pub fn exceeds(&self, most: f64) -> bool {
        self.changes.iter().any(|&change| exceeds(change, most))
    }
}

/// Rejects the frames of `intervals` with a joint that is missing for longer than lifting fills.
pub fn missing_joint_rejections(raw: &Motion, intervals: &[Interval]) -> Vec<Option<FrameRejection>> {
    let mut rejections = vec![None; raw.n_frames()];
    for t in intervals.iter().flat_map(|interval| interval.start..interval.end) {
        let joints = raw.joints.slice(s![t, .., 0]);
        let n_open = joints.iter().filter(|x| !x.is_finite()).count();
        rejections[t] = (n_open > 0).then(|| FrameRejection::new(Rejection::MissingJoints, n_open as f64, 0.0));
    }
    rejections
}
