//! Directions of hands from the depth of the hand model, compared with the true depth of hands and forearms: how much
//! the body lifter can learn from them.

use super::clips::RenderedClip;
use ndarray::aview1;
use orator_base::math::vec3;
use orator_base::math::vec3::Vec3;
use orator_base::types::skeleton::{L_ELBOW, L_HAND, L_WRIST, R_ELBOW, R_HAND, R_WRIST};
use orator_pipeline::lift::hand_direction::hand_directions;
use orator_test_support::rule::ridge::correlation;
use serde::Serialize;

/// Joints of a hand, relative to its first: the knuckles of the four fingers.
const KNUCKLES: [usize; 4] = [5, 9, 13, 17];

/// Correlations over all detected hands with depth; NaN without any.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct HandDepth {
    /// With the depth of the true hand's direction, and of the true forearm's.
    pub hand: f64,
    pub forearm: f64,
}

impl HandDepth {
    pub fn measure(clips: &[&RenderedClip]) -> Self {
        let (mut found_depths, mut hands, mut forearms) = (Vec::new(), Vec::new(), Vec::new());
        for clip in clips {
            for t in 0..clip.n_frames() {
                let at = |joint: usize| -> Vec3 { [0, 1, 2].map(|k| f64::from(clip.truth.joints[[t, joint, k]])) };
                let depth = |from: Vec3, to: Vec3| Some(vec3::unit(vec3::sub(to, from), 1e-9)?[2]);
                let arms = [[R_ELBOW, R_WRIST, R_HAND], [L_ELBOW, L_WRIST, L_HAND]];
                for (found, [elbow, wrist, hand]) in hand_directions(&clip.keypoints, t).into_iter().zip(arms) {
                    let knuckles = KNUCKLES.map(|joint| at(hand + joint)).into_iter().fold([0.0; 3], vec3::add);
                    let truth = depth(at(hand), vec3::scale(knuckles, 0.25)).zip(depth(at(elbow), at(wrist)));
                    let (Some([_, _, z]), Some((of_hand, of_forearm))) = (found, truth) else { continue };
                    found_depths.push(f64::from(z));
                    hands.push(of_hand);
                    forearms.push(of_forearm);
                }
            }
        }
        let with = |truth: &[f64]| match truth {
            [] => f64::NAN,
            truth => correlation(aview1(&found_depths), aview1(truth)),
        };
        Self { hand: with(&hands), forearm: with(&forearms) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::clips::tests::exact;
    use super::*;
    use ndarray::Array3;
    use orator_base::types::pose2d::N_HAND;

    #[test]
    fn true_depth_correlates_completely_and_its_opposite_inversely() {
        let mut clip = exact();
        let n = clip.n_frames();
        for (t, root) in (0..n).flat_map(|t| [(t, L_HAND), (t, R_HAND)]) {
            let tilt = 0.03 * (0.5 * t as f32).sin();
            KNUCKLES.into_iter().for_each(|joint| clip.truth.joints[[t, root + joint, 2]] += tilt);
        }
        for sign in [1.0, -1.0] {
            let depth = |(t, side, point): (usize, usize, usize)| {
                let root = [L_HAND, R_HAND][side];
                sign * 400.0 * (clip.truth.joints[[t, root + point, 2]] - clip.truth.joints[[t, root, 2]])
            };
            clip.keypoints.hand_depth = Some(Array3::from_shape_fn((n, 2, N_HAND), depth));
            let measured = HandDepth::measure(&[&clip]).hand;
            assert!(f64::from(sign) * measured > 0.99, "{sign}: {measured}");
        }
        clip.keypoints.hand_depth = None;
        let without = HandDepth::measure(&[&clip]);
        assert!(without.hand.is_nan() && without.forearm.is_nan());
    }
}
