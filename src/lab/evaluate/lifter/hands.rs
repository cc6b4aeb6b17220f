//! Errors of the hand lifter on captured or labelled fingers seen by random cameras. All hands have one size (middle
//! proximal phalanx 48 mm), a uniformly random rotation, a distance of 5 to 20 hand lengths, and keypoint noise of 2 %
//! of the palm. Errors are relative to the wrist in the camera's axes. A lifted hand is scaled to the true total bone
//! length, since a picture shows no size. The wrist and points that a source lacks do not count.

use crate::mocap::fingers::files::FingerSet;
use crate::mocap::fingers::take::Truth;
use crate::train::scene::hand_shape::{normal, random_rotation};
use anyhow::{Result, ensure};
use orator_base::math::order::median;
use orator_base::math::procrustes;
use orator_base::math::vec3;
use orator_base::motion::hand_bones::relaxed;
use orator_base::motion::view::hand::{HandJoints, HandPoints, parent};
use orator_base::types::pose2d::N_HAND;
use orator_base::types::skeleton::Side;
use orator_pipeline::lift::weights::{self, HandNetwork};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use std::path::Path;

/// Number of evaluated hands per set.
pub const MEASURED: usize = 4000;
/// Noise of a keypoint as a share of the distance from wrist to middle knuckle.
const NOISE: f64 = 0.02;
/// Distance from wrist to middle knuckle of a hand without knuckles, metres.
const PALM: f64 = 0.093;
/// Scale at the wrist, px per metre; unknown to the lifter.
const PX: f64 = 1000.0;

/// Lifter of right hands: keypoints to joints in any unit, the wrist at 0; `None`: not lifted.
pub type LiftHands = dyn Fn(&[HandPoints]) -> Result<Vec<Option<HandJoints>>>;

/// A lifter with its network and the file of its weights.
pub struct NamedLifter {
    network: String,
    lift: Box<LiftHands>,
}

/// Errors in mm, medians over all compared points of all hands.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct HandErrors {
    /// Error without alignment; `None` for hands without knuckles.
    pub median_mm: Option<f32>,
    /// Error after the similarity that fits each hand best.
    pub aligned_mm: f32,
    /// Share of hands with a mean error above 30 mm without alignment.
    pub above_30: Option<f64>,
}

/// Errors on one set of a lifter and of two baselines without a network.
#[derive(Clone, Debug, Serialize)]
pub struct HandRow {
    pub set: String,
    /// Network of the lifter, and the file of its weights.
    pub network: String,
    /// Source of the hands' size.
    pub size: &'static str,
    pub n_hands: usize,
    /// Share of the hands that were lifted.
    pub lifted: f64,
    pub lifter: HandErrors,
    /// Keypoints without depth, at the true scale.
    pub flat: HandErrors,
    /// Constant relaxed hand, rotated in the image plane, with palm or back towards the viewer, whichever fits better.
    pub relaxed: HandErrors,
}

/// A projected hand: true joints in metres in camera axes, and its keypoints in px.
struct ProjectedHand {
    truth: Truth,
    seen: HandPoints,
}

/// Errors of each lifter on each of `sets`, for `n_hands` hands per set, sampled with `seed`.
pub fn evaluate(lifters: &[NamedLifter], sets: &[FingerSet], n_hands: usize, seed: u64) -> Result<Vec<HandRow>> {
    sets.iter().flat_map(|set| lifters.iter().map(move |lifter| row(lifter, set, n_hands, seed))).collect()
}

/// Loads a lifter of either network from a weights file (the built-in one if `path` is empty).
pub fn lifter_of(path: &Path) -> Result<NamedLifter> {
    let lifter = weights::hands(path)?;
    let kind = match &lifter {
        HandNetwork::Coordinates(_) => "coordinates",
        HandNetwork::Heatmap(_) => "heatmap",
    };
    let file = path.file_name().map_or("built-in".into(), |name| name.to_string_lossy());
    Ok(NamedLifter { network: format!("{kind} ({file})"), lift: Box::new(move |seen| lifter.lift(seen, Side::Right)) })
}

fn row(lifter: &NamedLifter, set: &FingerSet, n_hands: usize, seed: u64) -> Result<HandRow> {
    let mut truths = Vec::new();
    for take in &set.takes {
        truths.extend(take.truths()?);
    }
    truths.retain(|t| t.counted.iter().filter(|c| **c).count() >= 3);
    ensure!(!truths.is_empty(), "no frame of {} has a wrist and at least three finger points", set.name);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let shots: Vec<ProjectedHand> =
        (0..n_hands).map(|_| shot(&truths[rng.random_range(0..truths.len())], &mut rng)).collect();
    let seen: Vec<HandPoints> = shots.iter().map(|s| s.seen).collect();
    let lifted = (lifter.lift)(&seen)?;
    let has_knuckles = set.takes.iter().all(|take| take.has_knuckles());
    let sized: Vec<Option<HandJoints>> =
        shots.iter().zip(&lifted).map(|(s, h)| Some(to_size(&s.truth, h.as_ref()?))).collect();
    let of = |hands: &[Option<HandJoints>]| errors(&shots, hands, has_knuckles);
    Ok(HandRow {
        set: set.name.clone(),
        network: lifter.network.clone(),
        size: set.takes.first().map_or("", |take| take.size.text()),
        n_hands,
        lifted: lifted.iter().filter(|h| h.is_some()).count() as f64 / n_hands.max(1) as f64,
        lifter: of(&sized),
        flat: of(&shots.iter().map(|s| Some(flat(&s.seen))).collect::<Vec<_>>()),
        relaxed: of(&shots.iter().map(|s| Some(relaxed_hand(&s.seen))).collect::<Vec<_>>()),
    })
}

fn shot(truth: &Truth, rng: &mut ChaCha8Rng) -> ProjectedHand {
    let turn = random_rotation(rng);
    let hand = truth.hand.map(|p| turn.turn(p));
    let distance = 0.19 * rng.random_range(5.0..20.0);
    let palm = if truth.there[9] { vec3::norm(hand[9]) } else { PALM };
    let seen = std::array::from_fn(|j| {
        let grow = distance / (distance + hand[j][2]);
        let at = [0, 1].map(|k| (PX * (hand[j][k] * grow + NOISE * palm * normal(rng))) as f32);
        truth.there[j].then_some(at)
    });
    ProjectedHand { truth: Truth { hand, ..truth.clone() }, seen }
}

/// The lifted hand, scaled to the true hand's total bone length.
fn to_size(truth: &Truth, hand: &HandJoints) -> HandJoints {
    let counts = |j: usize| j == 0 || truth.counted[j];
    let bones: Vec<usize> = (1..N_HAND).filter(|&j| counts(j) && counts(parent(j))).collect();
    let total = |h: &HandJoints| bones.iter().map(|&j| vec3::norm(vec3::sub(h[j], h[parent(j)]))).sum::<f64>();
    let grow = total(&truth.hand) / total(hand).max(1e-9);
    hand.map(|p| vec3::scale(p, grow))
}

fn flat(seen: &HandPoints) -> HandJoints {
    let [x0, y0] = seen[0].unwrap_or_default();
    seen.map(|p| p.map_or([0.0; 3], |[x, y]| [f64::from(x - x0) / PX, f64::from(y - y0) / PX, 0.0]))
}

fn relaxed_hand(seen: &HandPoints) -> HandJoints {
    let points = flat(seen);
    let palm = relaxed();
    let back = palm.map(|[x, y, z]| [-x, y, -z]);
    let fitted = [palm, back].map(|hand| {
        let there = || (1..N_HAND).filter(|&j| seen[j].is_some()).map(|j| (hand[j], points[j]));
        let cos: f64 = there().map(|(h, p)| h[0] * p[0] + h[1] * p[1]).sum();
        let sin: f64 = there().map(|(h, p)| h[0] * p[1] - h[1] * p[0]).sum();
        let angle = sin.atan2(cos);
        let turned = hand.map(|[x, y, z]| [angle.cos() * x - angle.sin() * y, angle.sin() * x + angle.cos() * y, z]);
        // Both have equal lengths; the better agreement wins.
        (cos.hypot(sin), turned)
    });
    let [(palm_fit, palm), (back_fit, back)] = fitted;
    if palm_fit >= back_fit { palm } else { back }
}

fn errors(shots: &[ProjectedHand], hands: &[Option<HandJoints>], has_knuckles: bool) -> HandErrors {
    let (mut plain, mut aligned, mut above, mut n) = (Vec::new(), Vec::new(), 0, 0);
    for (shot, hand) in shots.iter().zip(hands).filter_map(|(s, h)| Some((s, h.as_ref()?))) {
        let counted: Vec<usize> = (1..N_HAND).filter(|&j| shot.truth.counted[j]).collect();
        let off = |p: vec3::Vec3, j: usize| (1000.0 * vec3::norm(vec3::sub(p, shot.truth.hand[j]))) as f32;
        let own: Vec<f32> = counted.iter().map(|&j| off(hand[j], j)).collect();
        above += usize::from(own.iter().sum::<f32>() > 30.0 * own.len() as f32);
        n += 1;
        plain.extend(own);
        let with_wrist = |hand: &HandJoints| [0].iter().chain(&counted).map(|&j| hand[j]).collect::<Vec<_>>();
        if let Some(fit) = procrustes::similarity(&with_wrist(hand), &with_wrist(&shot.truth.hand)) {
            aligned.extend(counted.iter().map(|&j| off(fit.apply(hand[j]), j)));
        }
    }
    HandErrors {
        median_mm: median(plain).filter(|_| has_knuckles),
        aligned_mm: median(aligned).unwrap_or(f32::NAN),
        above_30: has_knuckles.then_some(above as f64 / f64::from(n.max(1))),
    }
}

/// The table as text, one line per set and network.
pub fn text(rows: &[HandRow]) -> String {
    let number = |value: Option<f32>| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.1}"));
    let one = |e: &HandErrors| format!("{:>5} /{:>5.1}", number(e.median_mm), e.aligned_mm);
    let mut lines = vec![format!(
        "{:<34} {:<40} {:>13} {:>8} {:>14} {:>14}   size",
        "hands: median / aligned error, mm", "network", "lifter", ">30 mm", "flat", "relaxed"
    )];
    lines.extend(rows.iter().map(|row| {
        let above = row.lifter.above_30.map_or_else(|| "-".to_owned(), |share| format!("{:.0} %", 100.0 * share));
        let (lifter, flat, relaxed) = (one(&row.lifter), one(&row.flat), one(&row.relaxed));
        let (set, network, size) = (&row.set, &row.network, row.size);
        format!("{set:<34} {network:<40} {lifter:>13} {above:>8} {flat:>14} {relaxed:>14}   {size}")
    }));
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mocap::fingers::take::{FingerTake, Size};

    fn resting(size: Size, known: impl Fn(usize) -> bool) -> FingerSet {
        let frame = std::array::from_fn(|j| known(j).then(|| relaxed()[j]));
        let take = FingerTake {
            name: "rest".into(),
            side: Side::Right,
            frames: vec![frame; 4],
            counted: [true; N_HAND],
            size,
        };
        FingerSet { name: "rest".into(), takes: vec![take] }
    }

    #[test]
    fn the_truth_is_without_error_and_points_without_truth_do_not_count() -> Result<()> {
        let set = resting(Size::Phalanx, |j| j != 4);
        let truths = set.takes[0].truths()?;
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let shots: Vec<ProjectedHand> = (0..60).map(|_| shot(&truths[0], &mut rng)).collect();
        let wrong_tip: Vec<Option<HandJoints>> = shots
            .iter()
            .map(|s| {
                let mut hand = s.truth.hand.map(|p| vec3::scale(p, 7.0));
                hand[4] = [9.0; 3];
                Some(to_size(&s.truth, &hand))
            })
            .collect();
        let found = errors(&shots, &wrong_tip, true);
        assert!(found.median_mm.is_some_and(|e| e < 1e-3) && found.aligned_mm < 1e-3 && found.above_30 == Some(0.0));
        Ok(())
    }

    #[test]
    fn the_built_in_lifter_is_far_better_than_no_depth() -> Result<()> {
        let lifters = [lifter_of(Path::new(""))?, lifter_of(Path::new(""))?];
        let sets = [resting(Size::Phalanx, |_| true), resting(Size::MiddleEnd, |j| j == 0 || j % 4 != 1 || j == 9)];
        let rows = evaluate(&lifters, &sets, 300, 5)?;
        let median = |e: HandErrors| e.median_mm.unwrap_or(f32::NAN);
        assert!(median(rows[0].lifter) < 20.0, "{rows:?}");
        assert!(median(rows[0].lifter) < 0.5 * median(rows[0].flat), "{rows:?}");
        assert!(rows[2].lifter.aligned_mm < 20.0 && rows[0].lifted == 1.0, "{rows:?}");
        assert_eq!((rows[0].lifter, &*rows[0].network), (rows[1].lifter, "coordinates (built-in)"));
        assert_eq!(text(&rows).lines().count(), 5);
        Ok(())
    }
}
