//! Hands in 3D: the hand lifter's shapes of one hand over an interval, freed of single wrong frames, with gaps filled.

use super::body::median;
use super::gaps::{long_gaps, neighbours};
use crate::motion::hand_view::{Hand, HandView, N_IN, N_OUT, SeenHand, parent};
use crate::motion::vec3;
use crate::nn::Mode;
use crate::nn::hand_lifter::HandLifter;
use crate::types::interval::Interval;
use crate::types::pose2d::N_HAND;
use crate::types::skeleton::Side;
use anyhow::Result;
use candle_core::{Device, Tensor};
use ndarray::Array3;

/// A hand's keypoint counts as seen from this score on.
const SEEN_SCORE: f32 = 0.2;
/// A hand with fewer points seen is not lifted.
const LEAST_POINTS: usize = 12;
/// Frames of the running median that takes single wrong shapes out, an odd number.
const MEDIAN_FRAMES: usize = 3;
/// Hands that go through the network together.
const BATCH: usize = 1024;
/// The middle finger's first phalanx in forearms (house measure: 48 mm for a forearm of 0.24 m).
const PHALANX_OF_FOREARM: f64 = 0.20;

/// One hand over an interval: shapes with the wrist at 0 and all bones together 1 long, `None` where the hand is
/// missing for long; and which points were seen.
pub struct Shapes {
    pub hands: Vec<Option<Hand>>,
    pub seen: Vec<[bool; N_HAND]>,
}

/// Lifts one hand over an interval; a gap of up to `max_gap` frames is filled.
pub fn lift(
    lifter: &HandLifter,
    points: &Array3<f32>,
    side: Side,
    interval: Interval,
    max_gap: usize,
) -> Result<Shapes> {
    let seen: Vec<SeenHand> = (interval.start..interval.end).map(|t| seen_points(points, t)).collect();
    let views: Vec<Option<HandView>> =
        seen.iter().map(|s| enough(s).then(|| HandView::of(s, side)).flatten()).collect();
    let mut found: Vec<Option<Hand>> = vec![None; seen.len()];
    let there: Vec<(usize, &HandView)> = views.iter().enumerate().filter_map(|(t, v)| Some((t, v.as_ref()?))).collect();
    for some in there.chunks(BATCH) {
        let x: Vec<f32> = some.iter().flat_map(|(_, view)| view.numbers).collect();
        let x = Tensor::from_vec(x, (some.len(), N_IN), &Device::Cpu)?;
        let out = lifter.forward(&x, &mut Mode::Eval)?.flatten_all()?.to_vec1::<f32>()?;
        for ((t, view), out) in some.iter().zip(out.chunks_exact(N_OUT)) {
            found[*t] = unit_size(view.hand(out));
        }
    }
    let lifted: Vec<bool> = found.iter().map(Option::is_some).collect();
    let seen = seen.iter().zip(&lifted).map(|(s, &there)| s.map(|p| there && p.is_some())).collect();
    Ok(Shapes { hands: filled(&steadied(&found), &long_gaps(&lifted, max_gap)), seen })
}

fn seen_points(points: &Array3<f32>, t: usize) -> SeenHand {
    std::array::from_fn(|j| {
        let [x, y, score] = [0, 1, 2].map(|k| points[[t, j, k]]);
        (score >= SEEN_SCORE && x.is_finite() && y.is_finite()).then_some([x, y])
    })
}

fn enough(seen: &SeenHand) -> bool {
    seen.iter().flatten().count() >= LEAST_POINTS
}

/// The hand with all its bones together 1 long; `None` of a hand without extent.
fn unit_size(hand: Hand) -> Option<Hand> {
    let bones: f64 = (1..N_HAND).map(|j| vec3::norm(vec3::sub(hand[j], hand[parent(j)]))).sum();
    (bones.is_finite() && bones > 1e-9).then(|| hand.map(|p| vec3::scale(p, 1.0 / bones)))
}

/// Each number the median of its frame and the frames beside it, as far as they are there.
fn steadied(found: &[Option<Hand>]) -> Vec<Option<Hand>> {
    let reach = MEDIAN_FRAMES / 2;
    let steady = |t: usize| {
        let now = found[t].as_ref()?;
        let around: Vec<&Hand> =
            found[t.saturating_sub(reach)..found.len().min(t + reach + 1)].iter().flatten().collect();
        if around.len() < MEDIAN_FRAMES {
            return Some(*now);
        }
        let middle = |j: usize, k: usize| median(around.iter().map(|h| h[j][k]).collect()).unwrap_or(now[j][k]);
        Some(std::array::from_fn(|j| std::array::from_fn(|k| middle(j, k))))
    };
    (0..found.len()).map(steady).collect()
}

/// Gaps that are not `open` filled: between two hands in proportion to the time, at an end with the nearest.
fn filled(found: &[Option<Hand>], open: &[bool]) -> Vec<Option<Hand>> {
    let neighbours = neighbours(found);
    let fill = |t: usize| {
        if open[t] {
            return None;
        }
        match neighbours[t] {
            (Some(a), Some(b)) if a < b => {
                let share = (t - a) as f64 / (b - a) as f64;
                let (from, to) = (found[a]?, found[b]?);
                Some(std::array::from_fn(|j| vec3::add(from[j], vec3::scale(vec3::sub(to[j], from[j]), share))))
            }
            (Some(a), _) => found[a],
            (None, Some(b)) => found[b],
            (None, None) => None,
        }
    };
    (0..found.len()).map(fill).collect()
}

/// The lengths in metres of a hand's bones for a forearm, over all `shapes` of both hands of a video: medians, of the
/// size that the middle finger's first phalanx sets. `None` when no hand was seen. Entry j: bone from its parent to j.
pub fn measure(shapes: &[&Shapes], forearm: f64) -> Option<[f64; N_HAND]> {
    let any_seen = shapes.iter().flat_map(|s| &s.seen).flatten().any(|seen| *seen);
    let mut lengths = [0.0; N_HAND];
    for (joint, length) in lengths.iter_mut().enumerate().skip(1) {
        let of_frame = |(hand, seen): (&Option<Hand>, &[bool; N_HAND])| {
            let hand = hand.as_ref().filter(|_| seen[joint] && seen[parent(joint)])?;
            Some(vec3::norm(vec3::sub(hand[joint], hand[parent(joint)])))
        };
        let all = shapes.iter().flat_map(|s| s.hands.iter().zip(&s.seen).filter_map(of_frame));
        // A bone that is never seen (a detector may leave points out) is as long as it was lifted.
        let lifted = || shapes.iter().flat_map(|s| &s.hands).flatten();
        let guess = || lifted().map(|hand| vec3::norm(vec3::sub(hand[joint], hand[parent(joint)]))).collect();
        *length = median(all.collect()).or_else(|| median(guess()).filter(|_| any_seen))?;
    }
    let grow = PHALANX_OF_FOREARM * forearm / lengths[10].max(1e-9);
    Some(lengths.map(|l| l * grow))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hand(v: f64) -> Option<Hand> {
        Some([[v, 0.0, -v]; N_HAND])
    }

    #[test]
    fn a_single_wrong_frame_goes_and_gaps_are_bridged() {
        let found = [hand(1.0), hand(2.0), hand(90.0), hand(4.0), None, None, hand(7.0), None];
        let steady = steadied(&found);
        assert_eq!(steady[2], hand(4.0));
        assert!(steady[4].is_none());
        let filled = filled(&steady, &[false, false, false, false, false, false, false, true]);
        assert_eq!(filled[5].map(|h| h[3][0]), Some(6.0));
        assert!(filled[7].is_none());
    }

    #[test]
    fn a_bone_never_seen_has_a_length_all_the_same() {
        let spread: Hand = std::array::from_fn(|j| [0.01 * j as f64, 0.02 * j as f64, 0.0]);
        let mut seen = [true; N_HAND];
        seen[20] = false;
        let shapes = Shapes { hands: vec![Some(spread); 3], seen: vec![seen; 3] };
        let lengths = measure(&[&shapes], 0.25).unwrap();
        assert!(lengths[1..].iter().all(|length| *length > 0.0), "{lengths:?}");
    }

    #[test]
    fn lengths_hang_on_the_forearm() {
        let straight: Hand =
            std::array::from_fn(|j| if j == 0 { [0.0; 3] } else { [0.0, -2.0 - ((j - 1) % 4) as f64, 0.0] });
        let shapes = Shapes { hands: vec![unit_size(straight); 3], seen: vec![[true; N_HAND]; 3] };
        let lengths = measure(&[&shapes], 0.25).unwrap();
        assert!((lengths[10] - 0.05).abs() < 1e-9 && (lengths[9] - 0.10).abs() < 1e-9 && lengths[0] == 0.0);
        let unseen = Shapes { hands: shapes.hands.clone(), seen: vec![[false; N_HAND]; 3] };
        assert!(measure(&[&unseen], 0.25).is_none());
        assert!(unit_size([[1.0; 3]; N_HAND]).is_none());
    }
}
