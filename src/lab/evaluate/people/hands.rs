//! Per-frame outcomes of hand detection: correct, missed, invented where none is visible, stolen (the other hand is
//! detected instead), swapped (both hands exchanged), or astray.

use super::clips::{HandArrays, RenderedClip};
use super::points::share;
use crate::rendered_truth::Visibility;
use orator_base::math::order::Ordered;
use orator_base::types::pose2d::{HAND_VISIBLE_SCORE, N_HAND};
use orator_base::types::skeleton::{L_HAND, R_HAND};
use serde::Serialize;

/// Share of visible points (of 21) from which a hand counts as visible, and up to which it counts as hidden; hands
/// between the two are not judged.
const SEEN_FROM: f64 = 0.6;
const HIDDEN_TO: f64 = 0.1;
/// Largest mean distance from a hand's true points for a detection of that hand, in palm lengths (wrist to middle
/// knuckle).
const SAME_HAND: f32 = 1.0;

/// Outcome of one hand in one frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HandOutcome {
    /// Neither visible nor detected, or too little of it visible to be judged.
    Unjudged,
    Right,
    Missed,
    Invented,
    /// The other hand's points.
    Stolen,
    /// The other hand's points, while the other hand has this one's.
    Swapped,
    /// Far from both hands.
    Astray,
}

impl HandOutcome {
    /// Whether the detected points do not belong to this hand.
    pub fn is_wrong(self) -> bool {
        matches!(self, Self::Invented | Self::Stolen | Self::Swapped | Self::Astray)
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
    let apart = |of: usize, from: usize| mean_distance(hands[of], hands[from], t) / palms[from];
    let takes_other = |side: usize| {
        let (own, other) = (apart(side, side), apart(side, 1 - side));
        found[side] && other < own && other < SAME_HAND
    };
    let others = [takes_other(0), takes_other(1)];
    [0, 1].map(|side| {
        let seen = seen_share(hands[side], t);
        match found[side] {
            false if seen >= SEEN_FROM => HandOutcome::Missed,
            false => HandOutcome::Unjudged,
            true if others == [true, true] => HandOutcome::Swapped,
            true if others[side] => HandOutcome::Stolen,
            true if seen <= HIDDEN_TO => HandOutcome::Invented,
            true if apart(side, side) > SAME_HAND => HandOutcome::Astray,
            true if seen >= SEEN_FROM => HandOutcome::Right,
            true => HandOutcome::Unjudged,
        }
    })
}

/// Whether any point of the hand is detected in a frame.
pub fn is_found(hand: HandArrays, t: usize) -> bool {
    (0..N_HAND).any(|point| hand.found[[t, point, 2]] >= HAND_VISIBLE_SCORE)
}

/// Share of the points that are visible, 0..1.
pub fn seen_share(hand: HandArrays, t: usize) -> f64 {
    share((0..N_HAND).filter(|&point| hand.seen[[t, point]] == Visibility::Seen).count(), N_HAND)
}

/// Mean distance of the detected points of one hand from the true points of another, px.
fn mean_distance(of: HandArrays, from: HandArrays, t: usize) -> f32 {
    let apart = |point: usize| {
        let [dx, dy] = [0, 1].map(|k| of.found[[t, point, k]] - from.truth[[t, point, k]]);
        dx.hypot(dy)
    };
    (0..N_HAND).map(apart).sum::<f32>() / N_HAND as f32
}

/// Hand statistics over clips; shares 0..1.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct HandCounts {
    /// Number of visible hands over all frames, and the shares of them that are missed, stolen, swapped, astray.
    pub n_seen: usize,
    pub missed: f64,
    pub stolen: f64,
    pub swapped: f64,
    pub astray: f64,
    /// Number of hidden hands, and the share of them that is invented.
    pub n_hidden: usize,
    pub invented: f64,
    /// Error of the points of correct hands relative to the shoulder width: median and 95th percentile.
    pub median: f64,
    pub p95: f64,
}

impl HandCounts {
    /// Counts over clips.
    pub fn measure(clips: &[&RenderedClip]) -> Self {
        let (mut n_seen, mut n_hidden, mut distances) = (0, 0, Vec::new());
        let mut counts = [0; 5];
        for clip in clips {
            for (t, frame) in outcomes(clip).into_iter().enumerate() {
                for (side, outcome) in frame.into_iter().enumerate() {
                    let hand = clip.hand(side);
                    let seen = seen_share(hand, t);
                    n_seen += usize::from(seen >= SEEN_FROM);
                    n_hidden += usize::from(seen <= HIDDEN_TO);
                    match outcome {
                        HandOutcome::Missed => counts[0] += 1,
                        HandOutcome::Stolen => counts[1] += 1,
                        HandOutcome::Swapped => counts[2] += 1,
                        HandOutcome::Astray => counts[3] += 1,
                        HandOutcome::Invented => counts[4] += 1,
                        HandOutcome::Right => {
                            let shoulders = clip.shoulders_px(t).max(1e-6);
                            let seen = (0..N_HAND).filter(|&point| hand.seen[[t, point]] == Visibility::Seen);
                            distances.extend(seen.map(|point| {
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
        let [missed, stolen, swapped, astray] = [0, 1, 2, 3].map(|k| share(counts[k], n_seen));
        let at = |share: f64| distances.quantile(share).unwrap_or(f64::NAN);
        let invented = share(counts[4], n_hidden);
        Self { n_seen, missed, stolen, swapped, astray, n_hidden, invented, median: at(0.5), p95: at(0.95) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::people::clips::tests::exact;
    use ndarray::s;

    #[test]
    fn each_kind_of_error_is_told_by_its_name() {
        let mut clip = exact();
        let (left, right) = (clip.keypoints.left_hand.clone(), clip.keypoints.right_hand.clone());
        // Frame 1: swapped; 2: the left hand is the right one again; 3: missed; 4: far off; 5: hidden and yet found.
        clip.keypoints.left_hand.slice_mut(s![1..3, .., ..]).assign(&right.slice(s![1..3, .., ..]));
        clip.keypoints.right_hand.slice_mut(s![1..2, .., ..]).assign(&left.slice(s![1..2, .., ..]));
        clip.keypoints.left_hand.slice_mut(s![3, .., ..]).fill(0.0);
        clip.keypoints.left_hand.slice_mut(s![4, .., 1]).mapv_inplace(|y| y - 150.0);
        clip.truth.left_hand_seen.slice_mut(s![5, ..]).fill(Visibility::BehindThing);
        let told = outcomes(&clip);
        use HandOutcome::{Astray, Invented, Missed, Right, Stolen, Swapped};
        let expected =
            [[Right, Right], [Swapped; 2], [Stolen, Right], [Missed, Right], [Astray, Right], [Invented, Right]];
        assert_eq!(told[..6], expected);
        assert!(told[6..].iter().all(|&frame| frame == [Right; 2]));
        let counts = HandCounts::measure(&[&clip]);
        assert_eq!((counts.n_seen, counts.n_hidden), (79, 1));
        assert_eq!((counts.swapped, counts.invented), (2.0 / 79.0, 1.0));
        assert!(counts.p95 < 1e-3);
    }
}
