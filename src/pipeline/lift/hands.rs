//! Hands in 3D: one hand over an interval through the hand lifter, then freed of wrong sides and single wrong
//! frames.

use super::hand_depth;
use super::observed::FARTHEST_PX;
use anyhow::Result;
use ndarray::{ArrayView3, ArrayViewMut2, ArrayViewMut3, Axis, s};
use orator_base::math::vec3;
use orator_base::motion::view::hand::{HandJoints, SeenHand, parent};
use orator_base::types::pose2d::{HAND_SEEN_SCORE, N_HAND};
use orator_base::types::skeleton::Side;
use orator_nn::lifter::hand::HandLifter;

/// A hand with fewer points seen is not lifted.
const LEAST_POINTS: usize = 12;
/// Hands that go through the network together.
const BATCH: usize = 1024;

/// Lifts one hand from `points` [T, 21, 3] into `joints` [T, 21, 3]: the wrist at 0, all bones together 1 long; NaN
/// where the hand is missing. `mask` [T, 21] says what was seen.
pub fn lift(
    lifter: &HandLifter,
    points: &ArrayView3<f32>,
    side: Side,
    frame_secs: f32,
    mut joints: ArrayViewMut3<f32>,
    mut mask: ArrayViewMut2<bool>,
) -> Result<()> {
    let n_frames = points.len_of(Axis(0));
    for start in (0..n_frames).step_by(BATCH) {
        let enough = |seen: SeenHand| if seen.iter().flatten().count() < LEAST_POINTS { [None; N_HAND] } else { seen };
        let seen: Vec<SeenHand> =
            (start..n_frames.min(start + BATCH)).map(|t| enough(seen_points(points, t))).collect();
        for (t, (hand, seen)) in (start..).zip(lifter.lift(&seen, side)?.into_iter().zip(&seen)) {
            let Some(hand) = hand.as_ref().and_then(unit_size) else { continue };
            (0..N_HAND).for_each(|j| mask[[t, j]] = seen[j].is_some());
            joints.slice_mut(s![t, .., ..]).indexed_iter_mut().for_each(|((j, k), v)| *v = hand[j][k] as f32);
        }
    }
    hand_depth::settle(joints.view_mut(), frame_secs);
    steady(joints.view_mut());
    Ok(())
}

fn seen_points(points: &ArrayView3<f32>, t: usize) -> SeenHand {
    std::array::from_fn(|j| {
        let [x, y, score] = [0, 1, 2].map(|k| points[[t, j, k]]);
        (score >= HAND_SEEN_SCORE && x.abs() <= FARTHEST_PX && y.abs() <= FARTHEST_PX).then_some([x, y])
    })
}

/// The hand with all its bones together 1 long; `None` of a hand without extent.
fn unit_size(hand: &HandJoints) -> Option<HandJoints> {
    let bones: f64 = (1..N_HAND).map(|j| vec3::norm(vec3::sub(hand[j], hand[parent(j)]))).sum();
    (bones.is_finite() && bones > 1e-9).then(|| hand.map(|p| vec3::scale(p, 1.0 / bones)))
}

/// Each number the median of its frame and the two beside it, where all three are there: takes single wrong shapes out.
fn steady(mut track: ArrayViewMut3<f32>) {
    for mut lane in track.lanes_mut(Axis(0)) {
        let mut before = f32::NAN;
        for t in 0..lane.len().saturating_sub(1) {
            let (now, after) = (lane[t], lane[t + 1]);
            let middle = before.max(now).min(before.min(now).max(after));
            if before.is_finite() && now.is_finite() && after.is_finite() {
                lane[t] = middle;
            }
            before = now;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array3;

    #[test]
    fn a_single_wrong_frame_goes() {
        let numbers = [1.0, 2.0, 90.0, 4.0, f32::NAN, 6.0, 0.0, 9.0, 8.0];
        let mut track = Array3::from_shape_fn((numbers.len(), 1, 1), |(t, _, _)| numbers[t]);
        steady(track.view_mut());
        let said = track.iter().map(|v| format!("{v}")).collect::<Vec<_>>().join(" ");
        assert_eq!(said, "1 2 4 4 NaN 6 6 8 8");
        steady(Array3::zeros((0, 1, 1)).view_mut());
    }

    #[test]
    fn a_hand_without_extent_is_none() {
        assert!(unit_size(&[[1.0; 3]; N_HAND]).is_none());
        let straight: HandJoints =
            std::array::from_fn(|j| if j == 0 { [0.0; 3] } else { [0.0, -2.0 - ((j - 1) % 4) as f64, 0.0] });
        let hand = unit_size(&straight).unwrap();
        assert!((hand[9][1] / hand[10][1] - 2.0 / 3.0).abs() < 1e-9);
    }
}
