//! Errors of a hand model on rendered persons, fitted as the noise model with which the hand lifter is trained
//! (`train::scene::hand_noise`).

use super::bias_fit::{self, OUTLIER_STDS, deviation};
use super::clips::RenderedClip;
use super::hands::{HandOutcome, outcomes};
use crate::rendered_truth::Visibility;
use crate::train::scene::hand_noise::{FingerNoise, HandNoise, N_BASIS, N_FINGERS, N_OF_FINGER, N_POINTS, basis};
use orator_base::math::order::Ordered;
use orator_base::types::pose2d::N_HAND;
use orator_base::types::skeleton::{L_HAND, R_HAND};

/// Number of hidden points from which a finger counts as hidden.
const HIDDEN_POINTS: usize = 2;

/// Errors of a hand in a frame, relative to the wrist, in palm lengths.
struct HandResidual {
    errors: [[f64; 2]; N_POINTS],
    basis: [[[f64; 2]; N_BASIS]; N_POINTS],
    hidden: [bool; N_FINGERS],
}

/// Fits the noise of the model set `set` over the correctly detected hands.
pub fn fit(set: &str, clips: &[RenderedClip]) -> HandNoise {
    let mut hands = Vec::new();
    for clip in clips {
        for (t, frame) in outcomes(clip).into_iter().enumerate() {
            for (side, outcome) in frame.into_iter().enumerate() {
                if matches!(outcome, HandOutcome::Correct | HandOutcome::Unjudged) {
                    hands.extend(HandResidual::new(clip, t, side));
                }
            }
        }
    }
    let bias: [[f64; N_BASIS]; N_POINTS] = std::array::from_fn(|point| bias(&hands, point));
    for hand in &mut hands {
        for ((error, basis), bias) in hand.errors.iter_mut().zip(&hand.basis).zip(&bias) {
            *error = bias_fit::residual(*error, basis, bias);
        }
    }
    let mean_error = |hand: &HandResidual, k: usize| hand.errors.iter().map(|e| e[k]).sum::<f64>() / N_POINTS as f64;
    let mean_errors: Vec<f64> = hands.iter().flat_map(|hand| [mean_error(hand, 0), mean_error(hand, 1)]).collect();
    let n_hidden = hands.iter().flat_map(|hand| hand.hidden).filter(|h| *h).count();
    HandNoise {
        set: set.to_owned(),
        bias,
        hand: deviation(&mean_errors),
        visible: finger_noise(&hands, false, mean_error),
        hidden: finger_noise(&hands, true, mean_error),
        hidden_share: n_hidden as f64 / (N_FINGERS * hands.len()).max(1) as f64,
    }
}

impl HandResidual {
    /// `None` if the hand is not detected, entirely misplaced, or partly outside the image.
    fn new(clip: &RenderedClip, t: usize, side: usize) -> Option<Self> {
        let hand = clip.hand(side);
        if (0..N_HAND).any(|j| hand.found[[t, j, 2]] <= 0.0 || hand.visibility[[t, j]] == Visibility::Outside) {
            return None;
        }
        let root = [L_HAND, R_HAND][side];
        let palm = f64::from(clip.px_of_bone(t, root, root + 9)).max(1.0);
        let truth: [[f64; 2]; N_HAND] =
            std::array::from_fn(|j| [0, 1].map(|k| f64::from(hand.truth[[t, j, k]] - hand.truth[[t, 0, k]]) / palm));
        let found = |j: usize| [0, 1].map(|k| f64::from(hand.found[[t, j, k]] - hand.found[[t, 0, k]]) / palm);
        let errors: [[f64; 2]; N_POINTS] =
            std::array::from_fn(|point| [0, 1].map(|k| found(point + 1)[k] - truth[point + 1][k]));
        let is_hidden = |finger: usize| {
            let points = 1 + N_OF_FINGER * finger..=N_OF_FINGER * (finger + 1);
            points.filter(|&j| hand.visibility[[t, j]] != Visibility::Visible).count() >= HIDDEN_POINTS
        };
        let mean = errors.iter().map(|e| e[0].hypot(e[1])).sum::<f64>() / N_POINTS as f64;
        (mean < 1.0).then(|| Self {
            errors,
            basis: std::array::from_fn(|point| basis(&truth, point + 1)),
            hidden: std::array::from_fn(is_hidden),
        })
    }
}

/// Weights of the bias of a point over the visible fingers.
fn bias(hands: &[HandResidual], point: usize) -> [f64; N_BASIS] {
    let seen = || hands.iter().filter(|hand| !hand.hidden[point / N_OF_FINGER]);
    bias_fit::weights(&[f64::INFINITY, 0.4], || seen().map(|hand| (hand.errors[point], hand.basis[point])))
}

fn finger_noise(hands: &[HandResidual], hidden: bool, mean_error: impl Fn(&HandResidual, usize) -> f64) -> FingerNoise {
    let (mut fingers, mut points) = (Vec::new(), Vec::new());
    for hand in hands {
        for finger in (0..N_FINGERS).filter(|&finger| hand.hidden[finger] == hidden) {
            let of_finger = &hand.errors[N_OF_FINGER * finger..N_OF_FINGER * (finger + 1)];
            for k in 0..2 {
                let mean = of_finger.iter().map(|e| e[k]).sum::<f64>() / N_OF_FINGER as f64;
                fingers.push(mean - mean_error(hand, k));
                points.extend(of_finger.iter().map(|e| e[k] - mean));
            }
        }
    }
    let finger = deviation(&fingers);
    let outliers: Vec<f64> = fingers.iter().map(|v| v.abs()).filter(|v| *v > OUTLIER_STDS * finger).collect();
    FingerNoise {
        finger,
        outlier_share: outliers.len() as f64 / fingers.len().max(1) as f64,
        outlier_finger_std: Ordered::new(outliers).quantile(0.68).unwrap_or(finger),
        point: deviation(&points),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::people::clips::tests::exact;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn the_fit_recovers_known_noise() {
        let mut known = HandNoise {
            set: String::new(),
            bias: [[0.0; N_BASIS]; N_POINTS],
            hand: 0.03,
            visible: FingerNoise { finger: 0.05, point: 0.02, ..FingerNoise::default() },
            hidden: FingerNoise::default(),
            hidden_share: 0.0,
        };
        known.bias[6] = [0.0, 0.0, 0.4];
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut clips = Vec::new();
        for _ in 0..40 {
            let mut clip = exact();
            for t in 0..clip.n_frames() {
                let palm = f64::from(clip.px_of_bone(t, R_HAND, R_HAND + 9));
                let mut hand = std::array::from_fn(|j| [0, 1].map(|k| f64::from(clip.truth.right_hand[[t, j, k]])));
                known.apply(&mut hand, palm, 1.0, true, &mut rng);
                for (j, point) in hand.iter().enumerate() {
                    (0..2).for_each(|k| clip.keypoints.right_hand[[t, j, k]] = point[k] as f32);
                }
            }
            clip.keypoints.left_hand.fill(0.0);
            clips.push(clip);
        }
        let found = fit("found", &clips);
        let near = |a: f64, b: f64, off: f64| assert!((a - b).abs() < off, "{a} {b}: {found:?}");
        near(found.visible.point, 0.02, 0.006);
        near(found.visible.finger, 0.05, 0.012);
        near(found.hand, 0.03, 0.012);
        let hand: [[f64; 2]; N_HAND] =
            std::array::from_fn(|j| [0, 1].map(|k| f64::from(exact().truth.right_hand[[0, j, k]])));
        let along =
            |bias: &HandNoise, k: usize| basis(&hand, 7).iter().zip(bias.bias[6]).map(|(v, w)| v[k] * w).sum::<f64>();
        (0..2).for_each(|k| near(along(&found, k), along(&known, k), 0.5));
    }
}
