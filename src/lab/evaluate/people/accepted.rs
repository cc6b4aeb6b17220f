//! Accepted intervals compared with the frames that are correct, in seconds, and the joint mask compared with the true
//! visibility.

use super::clips::RenderedClip;
use super::hands::{self, HandOutcome};
use super::points::{self, share};
use crate::rendered_truth::Visibility;
use orator_base::motion::upper_body::{ARMS, COCO};
use orator_base::types::pose2d::{N_HAND, VISIBLE_SCORE};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_HAND, N_HAND_JOINTS, R_HAND};
use serde::Serialize;

/// Error of an arm point above which a frame is incorrect, relative to the shoulder width.
const MAX_ARM_ERROR: f64 = 0.35;
/// Share of a hand's points that must be visible for a frame to be worth accepting.
const MIN_VISIBLE_HAND: f64 = 0.6;

/// Durations of clips in seconds by outcome.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct AcceptedSeconds {
    pub total: f64,
    pub accepted: f64,
    /// Accepted although a hand is a false positive, is detected on the other hand, swapped or misplaced, or an arm
    /// point is far off.
    pub false_accepts: f64,
    /// Rejected although both hands and all arm points are visible and correctly detected.
    pub false_rejects: f64,
    /// Share of the accepted seconds that are correct, and share of the correct ones that are accepted, 0..1.
    pub precision: f64,
    pub recall: f64,
}

impl AcceptedSeconds {
    /// Sums over clips.
    pub fn measure(clips: &[&RenderedClip]) -> Self {
        let mut sum = Self::default();
        for clip in clips {
            let secs = 1.0 / clip.keypoints.fps.per_sec();
            let accepted = clip.accepted();
            for (t, outcome) in hands::outcomes(clip).into_iter().enumerate() {
                let is_incorrect = outcome.iter().any(|hand| hand.is_incorrect()) || is_arm_incorrect(clip, t);
                sum.total += secs;
                if accepted[t] {
                    sum.accepted += secs;
                    sum.false_accepts += if is_incorrect { secs } else { 0.0 };
                } else if !is_incorrect
                    && outcome == [HandOutcome::Correct; 2]
                    && are_arms_detected(clip, t)
                    && both_visible(clip, t)
                {
                    sum.false_rejects += secs;
                }
            }
        }
        let correct = sum.accepted - sum.false_accepts;
        sum.precision = correct / sum.accepted;
        sum.recall = correct / (correct + sum.false_rejects);
        sum
    }
}

fn both_visible(clip: &RenderedClip, t: usize) -> bool {
    [0, 1].iter().all(|&side| hands::visible_share(clip.hand(side), t) >= MIN_VISIBLE_HAND)
}

/// COCO indices of shoulders, elbows and wrists.
fn arm_points() -> impl Iterator<Item = usize> {
    ARMS.map(|joint| COCO[joint])
}

fn is_arm_incorrect(clip: &RenderedClip, t: usize) -> bool {
    arm_points().any(|point| {
        let is_judged = clip.keypoints.body[[t, point, 2]] > VISIBLE_SCORE
            && clip.truth.body_visibility[[t, point]] != Visibility::Outside;
        let [dx, dy] = points::error(clip, t, point);
        is_judged && dx.hypot(dy) > MAX_ARM_ERROR
    })
}

fn are_arms_detected(clip: &RenderedClip, t: usize) -> bool {
    arm_points().all(|point| {
        clip.truth.body_visibility[[t, point]] != Visibility::Outside
            && clip.keypoints.body[[t, point, 2]] > VISIBLE_SCORE
    })
}

/// Mask of lifted joints compared with the true visibility; shares 0..1.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct MaskCounts {
    /// Number of joints in accepted frames that the mask marks as visible, and the share of them that is visible.
    pub n_masked: usize,
    pub visible_share: f64,
    /// Number of visible joints in accepted frames, and the share of them that the mask marks as visible.
    pub n_visible: usize,
    pub masked: f64,
}

impl MaskCounts {
    /// Counts over clips and their lifted motions.
    pub fn measure<'a>(clips: impl Iterator<Item = (&'a RenderedClip, &'a Motion)>) -> Self {
        let (mut n_masked, mut n_visible, mut n_both) = (0, 0, 0);
        for (clip, motion) in clips {
            for t in (0..clip.n_frames()).zip(clip.accepted()).filter_map(|(t, accepted)| accepted.then_some(t)) {
                for joint in ARMS.chain(L_HAND + 1..R_HAND).chain(R_HAND + 1..R_HAND + N_HAND_JOINTS) {
                    let (mask, visible) = (motion.mask[[t, joint]], visibility(clip, t, joint) == Visibility::Visible);
                    n_masked += usize::from(mask);
                    n_visible += usize::from(visible);
                    n_both += usize::from(mask && visible);
                }
            }
        }
        Self { n_masked, visible_share: share(n_both, n_masked), n_visible, masked: share(n_both, n_visible) }
    }
}

fn visibility(clip: &RenderedClip, t: usize, joint: usize) -> Visibility {
    match joint {
        _ if joint < L_HAND => clip.truth.body_visibility[[t, COCO[joint]]],
        _ if joint < R_HAND => clip.truth.left_hand_visibility[[t, (joint - L_HAND).min(N_HAND - 1)]],
        _ => clip.truth.right_hand_visibility[[t, (joint - R_HAND).min(N_HAND - 1)]],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::people::clips::tests::exact;
    use ndarray::s;
    use orator_base::types::interval::Interval;
    use orator_base::types::pose2d::coco;

    #[test]
    fn false_accepts_and_false_rejects_are_counted() {
        let mut clip = exact();
        // The first second is rejected although it is correct; in the next third the left hand is on the right.
        clip.intervals.intervals = vec![Interval { start: 15, end: 40 }];
        let right_hand = clip.keypoints.right_hand.slice(s![15..20, .., ..]).to_owned();
        clip.keypoints.left_hand.slice_mut(s![15..20, .., ..]).assign(&right_hand);
        clip.keypoints.body[[30, coco::L_ELBOW, 0]] += 0.5 * clip.shoulders_px(30);
        let seconds = AcceptedSeconds::measure(&[&clip]);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
        assert!(near(seconds.accepted, 25.0 / 15.0) && near(seconds.total, 40.0 / 15.0));
        assert!(near(seconds.false_accepts, 6.0 / 15.0) && near(seconds.false_rejects, 1.0), "{seconds:?}");
        assert!(near(seconds.precision, 19.0 / 25.0) && near(seconds.recall, 19.0 / 34.0), "{seconds:?}");
    }
}
