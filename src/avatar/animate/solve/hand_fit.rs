//! Noise reduction of a hand that uses all of its points: their positions in the axes of the palm change slowly and are
//! smoothed first, and this shape is then fitted rigidly to the observed points of every frame, so that the errors of
//! 21 points average out in the position and rotation of the hand. Motion without noise changes by the filter's
//! tolerance, for palms of any rigidity.

use super::positions::{HandPositions, JointPositions};
use super::smoothing::Filter;
use orator_base::math::procrustes::similarity;
use orator_base::math::vec3::{Vec3, add, dot, scale, sub};
use orator_base::types::skeleton::N_HAND_JOINTS;

/// Distance at which the filter's tolerance, an angle, applies to a point of the hand, metres.
const LEVER_METRES: f64 = 0.04;

/// Replaces both hands and wrists where the knuckles of index and little finger were detected; gaps remain.
pub fn with_fitted_hands(positions: JointPositions, filter: &Filter) -> JointPositions {
    if matches!(filter, Filter::None) {
        return positions;
    }
    (0..2).fold(positions, |positions, _| with_fitted_left_hand(&positions, filter).mirrored())
}

fn with_fitted_left_hand(positions: &JointPositions, filter: &Filter) -> JointPositions {
    let hands: Vec<HandPositions> = (0..positions.n_frames()).map(|t| positions.left_hand(t)).collect();
    let mut shapes: Vec<HandPositions> = vec![[None; N_HAND_JOINTS]; hands.len()];
    for point in 0..N_HAND_JOINTS {
        let in_palm = |(t, hand): (usize, &HandPositions)| {
            Some(scale(positions.hand_frame(t)?.inverse().turn(sub(hand[point]?, hand[0]?)), 1.0 / LEVER_METRES))
        };
        let mut track: Vec<Option<Vec3>> = hands.iter().enumerate().map(in_palm).collect();
        filter.runs(&mut track, &[]);
        for (shape, smooth) in shapes.iter_mut().zip(track) {
            shape[point] = smooth.map(|smooth| scale(smooth, LEVER_METRES));
        }
    }
    let fitted = shapes.iter().zip(&hands).map(|(shape, hand)| fitted(shape, hand));
    positions.with_left_hand(&fitted.collect::<Vec<_>>())
}

/// The shape, moved rigidly to the observed points; `None` for fewer than three points.
fn fitted(shape: &HandPositions, hand: &HandPositions) -> Option<HandPositions> {
    let pairs = shape.iter().zip(hand).filter_map(|(from, to)| Some(((*from)?, (*to)?)));
    let (from, to): (Vec<Vec3>, Vec<Vec3>) = pairs.unzip();
    let rows = similarity(&from, &to)?.rotation;
    let mean =
        |points: &[Vec3]| scale(points.iter().fold([0.0; 3], |sum, &point| add(sum, point)), 1.0 / points.len() as f64);
    let (from, to) = (mean(&from), mean(&to));
    let moved = |point: Vec3| add(to, rows.map(|row| dot(row, sub(point, from))));
    Some(shape.map(|point| point.map(moved)))
}
