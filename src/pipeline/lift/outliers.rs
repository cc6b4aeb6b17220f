//! What lifting tells of a video beyond its keypoints: frames whose bones came out far from the lengths they have in the
//! rest of the video (a wrong keypoint, another person's arm), and frames in which a joint stayed open. `refuse` takes
//! them out of intervals and ledger.

use super::lengths::bone;
use super::refuse::{bone_refusals, exceeds};
use ndarray::{Array2, s};
use orator_base::math::order::lower_median;
use orator_base::stage::refusal::{FrameRefusal, Refusal};
use orator_base::types::interval::Interval;
use orator_base::types::pose2d::{Keypoints, coco};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::BODY_BONES;

/// The keypoints of the ends of `BODY_BONES`.
const POINTS: [(usize, usize); 5] = [
    (coco::R_SHOULDER, coco::L_SHOULDER),
    (coco::R_SHOULDER, coco::R_ELBOW),
    (coco::L_SHOULDER, coco::L_ELBOW),
    (coco::R_ELBOW, coco::R_WRIST),
    (coco::L_ELBOW, coco::L_WRIST),
];

/// How far the bones of each frame are from their lengths in the video.
pub struct BoneChange {
    /// [T, 5]: length in the frame by the bone's median in the video, less 1; NaN where an end is not seen.
    changes: Array2<f32>,
}

impl BoneChange {
    /// Measures bones as they were lifted, before they are given one length each.
    pub fn measure(raw: &Motion) -> Self {
        let mut changes = Array2::from_elem((raw.n_frames(), BODY_BONES.len()), f32::NAN);
        for (i, (from, to)) in BODY_BONES.into_iter().enumerate() {
            let seen = |t: usize| raw.mask[[t, from]] && raw.mask[[t, to]];
            let length = |t: usize| if seen(t) { bone(raw, t, from, to) } else { f32::NAN };
            let lengths: Vec<f32> = (0..raw.n_frames()).map(length).collect();
            let usual = lower_median(lengths.iter().copied()).unwrap_or(f32::NAN);
            changes.column_mut(i).iter_mut().zip(lengths).for_each(|(change, length)| *change = length / usual - 1.0);
        }
        Self { changes }
    }

    /// The farthest of a frame's bones, [T]; NaN where none is seen.
    pub fn farthest(&self) -> Vec<f32> {
        self.changes
            .outer_iter()
            .map(|bones| bones.iter().map(|change| change.abs()).fold(f32::NAN, f32::max))
            .collect()
    }

    /// Refuses the frames of runs longer than `max_gap` in which a bone is more than `most` off. In shorter runs the ends
    /// of such bones are made unseen in `keypoints`, so that lifting fills them.
    pub fn judge(&self, most: f64, max_gap: usize, keypoints: &mut Keypoints) -> Vec<Option<FrameRefusal>> {
        let refusals = bone_refusals(&self.farthest(), most, max_gap);
        for (changes, t) in self.changes.outer_iter().zip(0..).filter(|(_, t)| refusals[*t].is_none()) {
            for (&change, (from, to)) in changes.iter().zip(POINTS) {
                if exceeds(change, most) {
                    for point in [from, to] {
                        keypoints.body[[t, point, 2]] = 0.0;
                    }
                }
            }
        }
        refusals
    }

    /// Whether any frame is more than `most` off.
    pub fn exceeds(&self, most: f64) -> bool {
        self.changes.iter().any(|&change| exceeds(change, most))
    }
}

/// Refuses the frames of `intervals` in which a joint was not seen for longer than lifting fills.
pub fn open_refusals(raw: &Motion, intervals: &[Interval]) -> Vec<Option<FrameRefusal>> {
    let mut refusals = vec![None; raw.n_frames()];
    for t in intervals.iter().flat_map(|interval| interval.start..interval.end) {
        let joints = raw.joints.slice(s![t, .., 0]);
        let n_open = joints.iter().filter(|x| !x.is_finite()).count();
        refusals[t] = (n_open > 0).then(|| FrameRefusal::new(Refusal::MissingJoints, n_open as f64, 0.0));
    }
    refusals
}
