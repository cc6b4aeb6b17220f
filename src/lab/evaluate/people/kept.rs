//! Accepted intervals compared with the frames that are correct, in seconds, and the joint mask compared with the true
//! visibility.

use super::clips::RenderedClip;
use super::hands::{self, HandOutcome};
use super::points::{self, share};
use crate::rendered_truth::Visibility;
use orator_base::motion::upper_body::{ARMS, COCO};
use orator_base::types::pose2d::{N_HAND, SEEN_SCORE};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_HAND, N_HAND_JOINTS, R_HAND};
use serde::Serialize;

/// Error of an arm point above which a frame is wrong, relative to the shoulder width.
const WRONG_ARM: f64 = 0.35;
/// Share of a hand's points that must be visible for a frame to be worth accepting.
const SEEN_HAND: f64 = 0.6;

/// Durations of clips in seconds by outcome.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct KeptSeconds {
    pub total: f64,
    pub kept: f64,
    /// Accepted although a hand is invented, stolen, swapped or astray, or an arm point is far off.
    pub kept_wrongly: f64,
    /// Rejected although both hands and all arm points are visible and correctly detected.
    pub refused_wrongly: f64,
}

impl KeptSeconds {
    /// Sums over clips.
    pub fn measure(clips: &[&RenderedClip]) -> Self {
        let mut sum = Self::default();
        for clip in clips {
            let secs = 1.0 / clip.keypoints.fps.per_sec();
            let kept = clip.kept();
            for (t, outcome) in hands::outcomes(clip).into_iter().enumerate() {
                let is_wrong = outcome.iter().any(|hand| hand.is_wrong()) || is_arm_wrong(clip, t);
                sum.total += secs;
                if kept[t] {
                    sum.kept += secs;
                    sum.kept_wrongly += if is_wrong { secs } else { 0.0 };
                } else if !is_wrong
                    && outcome == [HandOutcome::Right; 2]
                    && are_arms_seen(clip, t)
                    && both_seen(clip, t)
                {
                    sum.refused_wrongly += secs;
                }
            }
        }
        sum
    }
}

fn both_seen(clip: &RenderedClip, t: usize) -> bool {
    [0, 1].iter().all(|&side| hands::seen_share(clip.hand(side), t) >= SEEN_HAND)
}

/// COCO indices of shoulders, elbows and wrists.
fn arm_points() -> impl Iterator<Item = usize> {
    ARMS.map(|joint| COCO[joint])
}

fn is_arm_wrong(clip: &RenderedClip, t: usize) -> bool {
    arm_points().any(|point| {
        let is_judged =
            clip.keypoints.body[[t, point, 2]] > SEEN_SCORE && clip.truth.body_seen[[t, point]] != Visibility::Outside;
        let [dx, dy] = points::error(clip, t, point);
        is_judged && dx.hypot(dy) > WRONG_ARM
    })
}

fn are_arms_seen(clip: &RenderedClip, t: usize) -> bool {
    arm_points().all(|point| {
        clip.truth.body_seen[[t, point]] != Visibility::Outside && clip.keypoints.body[[t, point, 2]] > SEEN_SCORE
    })
}

/// Mask of lifted joints compared with the true visibility; shares 0..1.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct MaskCounts {
    /// Number of joints in accepted frames that the mask marks as visible, and the share of them that is visible.
    pub n_masked: usize,
    pub truly_seen: f64,
    /// Number of visible joints in accepted frames, and the share of them that the mask marks as visible.
    pub n_seen: usize,
    pub masked: f64,
}

impl MaskCounts {
    /// Counts over clips and their lifted motions.
    pub fn measure<'a>(clips: impl Iterator<Item = (&'a RenderedClip, &'a Motion)>) -> Self {
        let (mut n_masked, mut n_seen, mut n_both) = (0, 0, 0);
        for (clip, motion) in clips {
            for t in (0..clip.n_frames()).zip(clip.kept()).filter_map(|(t, kept)| kept.then_some(t)) {
                for joint in ARMS.chain(L_HAND + 1..R_HAND).chain(R_HAND + 1..R_HAND + N_HAND_JOINTS) {
                    let (mask, seen) = (motion.mask[[t, joint]], visibility(clip, t, joint) == Visibility::Seen);
                    n_masked += usize::from(mask);
                    n_seen += usize::from(seen);
                    n_both += usize::from(mask && seen);
                }
            }
        }
        Self { n_masked, truly_seen: share(n_both, n_masked), n_seen, masked: share(n_both, n_seen) }
    }
}

fn visibility(clip: &RenderedClip, t: usize, joint: usize) -> Visibility {
    match joint {
        _ if joint < L_HAND => clip.truth.body_seen[[t, COCO[joint]]],
        _ if joint < R_HAND => clip.truth.left_hand_seen[[t, (joint - L_HAND).min(N_HAND - 1)]],
        _ => clip.truth.right_hand_seen[[t, (joint - R_HAND).min(N_HAND - 1)]],
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
    fn seconds_are_wrong_both_ways() {
        let mut clip = exact();
        // The first second is refused although it is right, the next third of one is kept with a stolen hand.
        clip.intervals.intervals = vec![Interval { start: 15, end: 40 }];
        let right = clip.keypoints.right_hand.slice(s![15..20, .., ..]).to_owned();
        clip.keypoints.left_hand.slice_mut(s![15..20, .., ..]).assign(&right);
        clip.keypoints.body[[30, coco::L_ELBOW, 0]] += 0.5 * clip.shoulders_px(30);
        let seconds = KeptSeconds::measure(&[&clip]);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
        assert!(near(seconds.kept, 25.0 / 15.0) && near(seconds.total, 40.0 / 15.0));
        assert!(near(seconds.kept_wrongly, 6.0 / 15.0) && near(seconds.refused_wrongly, 1.0), "{seconds:?}");
    }
}
