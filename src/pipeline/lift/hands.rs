//! 3D lifting of hands: a hand over an interval through the lifter, then correction of depth ambiguity and outliers.

use super::hand_depth;
use super::observed::MAX_PX;
use super::weights::HandNetwork;
use anyhow::Result;
use ndarray::{ArrayView2, ArrayView3, ArrayViewMut2, ArrayViewMut3, Axis, s};
use orator_base::math::vec3;
use orator_base::motion::view::hand::{HandJoints, HandPoints, parent};
use orator_base::types::pose2d::{HAND_VISIBLE_SCORE, N_HAND};
use orator_base::types::skeleton::Side;

/// Least number of visible points of a hand that is lifted.
const MIN_POINTS: usize = 12;
const BATCH: usize = 1024;

/// Lifts one hand from `points` [T, 21, 3] (x, y in px, score) into `joints` [T, 21, 3]: wrist at 0, sum of the bone
/// lengths 1; NaN where the hand is missing. `mask` [T, 21] marks the visible points. `depth` [T, 21]: depth of the hand
/// model, if it gives one.
///
/// # Errors
/// Those of the network.
pub fn lift(
    lifter: &HandNetwork,
    points: &ArrayView3<f32>,
    depth: Option<ArrayView2<f32>>,
    side: Side,
    frame_secs: f32,
    mut joints: ArrayViewMut3<f32>,
    mut mask: ArrayViewMut2<bool>,
) -> Result<()> {
    let n_frames = points.len_of(Axis(0));
    for start in (0..n_frames).step_by(BATCH) {
        let or_empty =
            |visible: HandPoints| if visible.iter().flatten().count() < MIN_POINTS { [None; N_HAND] } else { visible };
        let visible: Vec<HandPoints> =
            (start..n_frames.min(start + BATCH)).map(|t| or_empty(visible_points(points, t))).collect();
        for (t, (hand, visible)) in (start..).zip(lifter.lift(&visible, side)?.into_iter().zip(&visible)) {
            let Some(hand) = hand.as_ref().and_then(unit_size) else { continue };
            (0..N_HAND).for_each(|j| mask[[t, j]] = visible[j].is_some());
            joints.slice_mut(s![t, .., ..]).indexed_iter_mut().for_each(|((j, k), v)| *v = hand[j][k] as f32);
        }
    }
    hand_depth::resolve(joints.view_mut(), depth, frame_secs);
    median_filter(joints.view_mut());
    Ok(())
}

fn visible_points(points: &ArrayView3<f32>, t: usize) -> HandPoints {
    std::array::from_fn(|j| {
        let [x, y, score] = [0, 1, 2].map(|k| points[[t, j, k]]);
        (score >= HAND_VISIBLE_SCORE && x.abs() <= MAX_PX && y.abs() <= MAX_PX).then_some([x, y])
    })
}

/// Scales a hand to a sum of bone lengths of 1; `None` for a hand without extent.
fn unit_size(hand: &HandJoints) -> Option<HandJoints> {
    let bones: f64 = (1..N_HAND).map(|j| vec3::norm(vec3::sub(hand[j], hand[parent(j)]))).sum();
    (bones.is_finite() && bones > 1e-9).then(|| hand.map(|p| vec3::scale(p, 1.0 / bones)))
}

/// Median filter over three frames, where all are present; removes single outliers.
fn median_filter(mut track: ArrayViewMut3<f32>) {
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
    fn a_single_outlier_is_removed() {
        let numbers = [1.0, 2.0, 90.0, 4.0, f32::NAN, 6.0, 0.0, 9.0, 8.0];
        let mut track = Array3::from_shape_fn((numbers.len(), 1, 1), |(t, _, _)| numbers[t]);
        median_filter(track.view_mut());
        let text = track.iter().map(|v| format!("{v}")).collect::<Vec<_>>().join(" ");
        assert_eq!(text, "1 2 4 4 NaN 6 6 8 8");
        median_filter(Array3::zeros((0, 1, 1)).view_mut());
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
