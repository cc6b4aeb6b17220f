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

/// Replaces both hands and wrists in frames in which the knuckles of index and little finger were detected; missing
/// points stay missing.
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
            let into_palm = positions.hand_frame(t)?.inverse();
            Some(scale(into_palm.turn(sub(hand[point]?, hand[0]?)), 1.0 / LEVER_METRES))
        };
        let mut track: Vec<Option<Vec3>> = hands.iter().enumerate().map(in_palm).collect();
        filter.runs(&mut track, &[]);
        for (shape, smooth) in shapes.iter_mut().zip(track) {
            shape[point] = smooth.map(|smooth| scale(smooth, LEVER_METRES));
        }
    }
    let fitted: Vec<Option<HandPositions>> =
        shapes.iter().zip(&hands).map(|(shape, hand)| fitted(shape, hand)).collect();
    positions.with_left_hand(&fitted)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::animate::solve::smoothing::Smoothing;
    use orator_base::math::rotation::Rotation;
    use orator_base::math::vec3::norm;
    use orator_base::types::pose3d::Motion;
    use orator_base::types::skeleton::{L_HAND, L_WRIST, N_JOINTS, R_HAND, R_WRIST};
    use orator_base::types::time::FrameRate;

    /// Both hands turn about the vertical while the fingers bend slowly; `noise` metres of white noise in every point.
    fn turning(noise: f64) -> Motion {
        let mut state = 1u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1u32 << 31) - 0.5
        };
        let mut joints = ndarray::Array3::<f32>::zeros((90, N_JOINTS, 3));
        for (t, mut frame) in joints.outer_iter_mut().enumerate() {
            let secs = t as f64 / 30.0;
            let turn = Rotation::about([0.0, 1.0, 0.0], 1.5 * (4.0 * secs).sin());
            for point in 0..N_HAND_JOINTS {
                let (finger, bone) = ((point.max(1) - 1) / 4, (point.max(1) - 1) % 4);
                let along = if point == 0 { 0.0 } else { 0.08 + 0.03 * bone as f64 };
                let bend = 0.01 * bone as f64 * (1.0 + secs.sin());
                let at = turn.turn([along, -bend, 0.03 - 0.02 * finger as f64]);
                let at = if point == 0 { [0.0; 3] } else { at };
                for (root, sign) in [(L_HAND, 1.0), (R_HAND, -1.0)] {
                    let error = [0, 1, 2].map(|_| noise * (0..12).map(|_| uniform()).sum::<f64>());
                    let [x, y, z] = add(at, error);
                    let at = [sign * (0.3 + x), -y, -z];
                    (0..3).for_each(|k| frame[[root + point, k]] = at[k] as f32);
                }
            }
            for (wrist, root) in [(L_WRIST, L_HAND), (R_WRIST, R_HAND)] {
                (0..3).for_each(|k| frame[[wrist, k]] = frame[[root, k]]);
            }
        }
        Motion::from_joints(FrameRate::new(30, 1), joints)
    }

    /// Mean distance of the points of both hands, metres.
    fn distance(a: &JointPositions, b: &JointPositions) -> f64 {
        let hands = |a: &JointPositions, b: &JointPositions| {
            let points = |t: usize| a.left_hand(t).into_iter().zip(b.left_hand(t)).collect::<Vec<_>>();
            let each = (0..a.n_frames()).flat_map(points).map(|(a, b)| norm(sub(a.unwrap(), b.unwrap())));
            each.sum::<f64>() / (a.n_frames() * N_HAND_JOINTS) as f64
        };
        (hands(a, b) + hands(&a.mirrored(), &b.mirrored())) / 2.0
    }

    #[test]
    fn noise_of_hands_is_halved_and_exact_hands_are_preserved() {
        let fps = FrameRate::new(30, 1);
        let truth = JointPositions::from_motion(&turning(0.0));
        let filter = Smoothing::default().fingers(fps);
        let exact = distance(&with_fitted_hands(JointPositions::from_motion(&turning(0.0)), &filter), &truth);
        assert!(exact < 0.0006, "{exact} m");
        let noisy = turning(0.005);
        let before = distance(&JointPositions::from_motion(&noisy), &truth);
        let after = distance(&with_fitted_hands(JointPositions::from_motion(&noisy), &filter), &truth);
        assert!(after < 0.5 * before, "{before} -> {after} m");
        let unchanged = with_fitted_hands(JointPositions::from_motion(&noisy), &Smoothing::None.fingers(fps));
        assert!(distance(&unchanged, &JointPositions::from_motion(&noisy)) == 0.0);
    }

    #[test]
    fn missing_points_stay_missing_and_hands_without_knuckles_are_unchanged() {
        let mut motion = turning(0.005);
        motion.joints.slice_mut(ndarray::s![.., L_HAND + 4, ..]).fill(f32::NAN);
        motion.joints.slice_mut(ndarray::s![..40, R_HAND + 5, ..]).fill(f32::NAN);
        let raw = JointPositions::from_motion(&motion);
        let fitted = with_fitted_hands(JointPositions::from_motion(&motion), &Smoothing::default().fingers(motion.fps));
        assert!(fitted.left_hand(7)[4].is_none() && fitted.left_hand(7)[8].is_some());
        let (raw, fitted) = (raw.mirrored(), fitted.mirrored());
        assert_eq!(raw.left_hand(20), fitted.left_hand(20));
        assert_ne!(raw.left_hand(60), fitted.left_hand(60));
    }
}
