//! Per-frame outcomes of hand detection: correct, missed, false positive (none is visible), other hand (the points of
//! the other hand), swapped (both hands exchanged), or misplaced.

use super::clips::{HandArrays, RenderedClip};
use super::points::share;
use crate::rendered_truth::Visibility;
use orator_base::math::order::Ordered;
use orator_base::types::pose2d::{HAND_VISIBLE_SCORE, N_HAND};
use orator_base::types::skeleton::{L_HAND, R_HAND};
use serde::Serialize;

/// Share of visible points (of 21) from which a hand counts as visible, and up to which it counts as hidden; hands
/// between the two are not judged.
const MIN_VISIBLE: f64 = 0.6;
const MAX_HIDDEN: f64 = 0.1;
/// Largest mean distance from a hand's true points for a detection of that hand, in palm lengths (wrist to middle
/// knuckle).
const SAME_HAND: f32 = 1.0;

/// Outcome of one hand in one frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HandOutcome {
    /// Neither visible nor detected, or too little of it visible to be judged.
    Unjudged,
    Correct,
    Missed,
    FalsePositive,
    /// The other hand's points.
    OtherHand,
    /// The other hand's points, while the other hand has this one's.
    Swapped,
    /// Far from both hands.
    Misplaced,
}

impl HandOutcome {
    /// Whether the detected points do not belong to this hand.
    pub fn is_incorrect(self) -> bool {
        matches!(self, Self::FalsePositive | Self::OtherHand | Self::Swapped | Self::Misplaced)
    }
}

/// Outcomes of the left and the right hand, [T].
pub fn outcomes(clip: &RenderedClip) -> Vec<[HandOutcome; 2]> {
    (0..clip.n_frames()).map(|t| of_frame(clip, t)).collect()
}

fn of_frame(clip: &RenderedClip, t: usize) -> [HandOutcome; 2] {
    let hands = [clip.hand(0), clip.hand(1)];
    let palms = [L_HAND, R_HAND].map(|root| clip.px_of_bone(t, root, root + 9).max(1.0));
    let found = hands.map(|hand| is_found(hand, t));
    let distance = |of: usize, from: usize| mean_distance(hands[of], hands[from], t) / palms[from];
    let is_on_other = |side: usize| {
        let (own, other) = (distance(side, side), distance(side, 1 - side));
        found[side] && other < own && other < SAME_HAND
    };
    let others = [is_on_other(0), is_on_other(1)];
    [0, 1].map(|side| {
        let visible = visible_share(hands[side], t);
        match found[side] {
            false if visible >= MIN_VISIBLE => HandOutcome::Missed,
            false => HandOutcome::Unjudged,
            true if others == [true, true] => HandOutcome::Swapped,
            true if others[side] => HandOutcome::OtherHand,
            true if visible <= MAX_HIDDEN => HandOutcome::FalsePositive,
            true if distance(side, side) > SAME_HAND => HandOutcome::Misplaced,
            true if visible >= MIN_VISIBLE => HandOutcome::Correct,
            true => HandOutcome::Unjudged,
        }
    })
}

/// Whether any point of the hand is detected in a frame.
pub fn is_found(hand: HandArrays, t: usize) -> bool {
    (0..N_HAND).any(|point| hand.found[[t, point, 2]] >= HAND_VISIBLE_SCORE)
}

/// Share of the points that are visible, 0..1.
pub fn visible_share(hand: HandArrays, t: usize) -> f64 {
    share((0..N_HAND).filter(|&point| hand.visibility[[t, point]] == Visibility::Visible).count(), N_HAND)
}

/// Mean distance of the detected points of one hand from the true points of another, px.
fn mean_distance(of: HandArrays, from: HandArrays, t: usize) -> f32 {
    let distance = |point: usize| {
        let [dx, dy] = [0, 1].map(|k| of.found[[t, point, k]] - from.truth[[t, point, k]]);
        dx.hypot(dy)
    };
    (0..N_HAND).map(distance).sum::<f32>() / N_HAND as f32
}

/// Hand statistics over clips; shares 0..1.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct HandCounts {
    /// Number of visible hands over all frames, and the shares of them that are missed, detected on the other hand,
    /// swapped, misplaced.
    pub n_visible: usize,
    pub missed: f64,
    pub other_hand: f64,
    pub swapped: f64,
    pub misplaced: f64,
    /// Number of hidden hands, and the share of them that is detected nevertheless.
    pub n_hidden: usize,
    pub false_positives: f64,
    /// Error of the points of correct hands relative to the shoulder width: median and 95th percentile.
    pub median: f64,
    pub p95: f64,
}

impl HandCounts {
    /// Counts over clips.
    pub fn measure(clips: &[&RenderedClip]) -> Self {
        let (mut n_visible, mut n_hidden, mut distances) = (0, 0, Vec::new());
        let mut counts = [0; 5];
        for clip in clips {
            for (t, frame) in outcomes(clip).into_iter().enumerate() {
                for (side, outcome) in frame.into_iter().enumerate() {
                    let hand = clip.hand(side);
                    let visible = visible_share(hand, t);
                    n_visible += usize::from(visible >= MIN_VISIBLE);
                    n_hidden += usize::from(visible <= MAX_HIDDEN);
                    match outcome {
                        HandOutcome::Missed => counts[0] += 1,
                        HandOutcome::OtherHand => counts[1] += 1,
                        HandOutcome::Swapped => counts[2] += 1,
                        HandOutcome::Misplaced => counts[3] += 1,
                        HandOutcome::FalsePositive => counts[4] += 1,
                        HandOutcome::Correct => {
                            let shoulders = clip.shoulders_px(t).max(1e-6);
                            let visible =
                                (0..N_HAND).filter(|&point| hand.visibility[[t, point]] == Visibility::Visible);
                            distances.extend(visible.map(|point| {
                                let [dx, dy] = [0, 1].map(|k| hand.found[[t, point, k]] - hand.truth[[t, point, k]]);
                                f64::from(dx.hypot(dy) / shoulders)
                            }));
                        }
                        HandOutcome::Unjudged => (),
                    }
                }
            }
        }
        let distances = Ordered::new(distances);
        let [missed, other_hand, swapped, misplaced] = [0, 1, 2, 3].map(|k| share(counts[k], n_visible));
        let at = |share: f64| distances.quantile(share).unwrap_or(f64::NAN);
        let false_positives = share(counts[4], n_hidden);
        Self {
            n_visible,
            missed,
            other_hand,
            swapped,
            misplaced,
            n_hidden,
            false_positives,
            median: at(0.5),
            p95: at(0.95),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::people::clips::tests::exact;
    use ndarray::s;

    #[test]
    fn each_kind_of_error_has_its_own_outcome() {
        let mut clip = exact();
        let (left, right) = (clip.keypoints.left_hand.clone(), clip.keypoints.right_hand.clone());
        // Frame 1: swapped; 2: the left hand on the right one; 3: missed; 4: far off; 5: hidden and yet detected.
        clip.keypoints.left_hand.slice_mut(s![1..3, .., ..]).assign(&right.slice(s![1..3, .., ..]));
        clip.keypoints.right_hand.slice_mut(s![1..2, .., ..]).assign(&left.slice(s![1..2, .., ..]));
        clip.keypoints.left_hand.slice_mut(s![3, .., ..]).fill(0.0);
        clip.keypoints.left_hand.slice_mut(s![4, .., 1]).mapv_inplace(|y| y - 150.0);
        clip.truth.left_hand_visibility.slice_mut(s![5, ..]).fill(Visibility::BehindObject);
        let measured = outcomes(&clip);
        use HandOutcome::{Correct, FalsePositive, Misplaced, Missed, OtherHand, Swapped};
        let expected = [
            [Correct; 2],
            [Swapped; 2],
            [OtherHand, Correct],
            [Missed, Correct],
            [Misplaced, Correct],
            [FalsePositive, Correct],
        ];
        assert_eq!(measured[..6], expected);
        assert!(measured[6..].iter().all(|&frame| frame == [Correct; 2]));
        let counts = HandCounts::measure(&[&clip]);
        assert_eq!((counts.n_visible, counts.n_hidden), (79, 1));
        assert_eq!((counts.swapped, counts.false_positives), (2.0 / 79.0, 1.0));
        assert!(counts.p95 < 1e-3);
    }
}
