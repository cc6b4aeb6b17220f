//! Directions of hands as a hand model with relative depth sees them. Wrists bend by 10 to 29 degrees in half of the
//! frames. On rendered persons, MediaPipe's depth of the knuckles is 0.52 times the true one plus 0.11 (share of the
//! hand's length towards the camera counts as negative), with an error of 0.12 per frame (correlation 0.69 between
//! frames at 15 fps) and of 0.04 per clip, and 5 degrees in the picture.

use super::body_motion::SlowSwing;
use super::hand_shape::normal;
use super::noise::Runs;
use orator_base::math::vec3;
use orator_base::math::vec3::Vec3;
use orator_base::motion::upper_body::{HandDirections, L_ELBOW, L_WRIST, Pose, R_ELBOW, R_WRIST};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Share of the scenes without any hand: keypoints of other programs have no depth.
const WITHOUT_HANDS: f64 = 0.3;
/// Share of the hands that are never detected, and the gaps of the others.
const NEVER: f64 = 0.1;
const GAPS: Runs = Runs { begin: 0.02, end: 0.2 };
/// Standard deviation of the constant bend of a wrist and amplitude of its movement, as tangents.
const BEND: f64 = 0.25;
const MOVEMENT: f64 = 0.3;

/// Directions of the right and left hand in `truth`, frames `frame_secs` apart, with the errors of a hand model.
pub fn observed(truth: &[Pose], frame_secs: f64, rng: &mut ChaCha8Rng) -> Vec<HandDirections> {
    let mut hands = vec![[None; 2]; truth.len()];
    if rng.random_bool(WITHOUT_HANDS) {
        return hands;
    }
    let (slope, offset) = (rng.random_range(0.4..0.9), 0.06 + 0.06 * normal(rng));
    let deviation = rng.random_range(0.06..0.2);
    for (side, [elbow, wrist]) in [[R_ELBOW, R_WRIST], [L_ELBOW, L_WRIST]].into_iter().enumerate() {
        let is_missing = GAPS.sample(truth.len(), rng);
        if rng.random_bool(NEVER) {
            continue;
        }
        let axis: Vec3 = std::array::from_fn(|_| normal(rng));
        let bends = [0; 2].map(|_| (BEND * normal(rng), SlowSwing::sample(rng, MOVEMENT)));
        let offset = offset + 0.04 * normal(rng);
        let mut errors = [0; 2].map(|_| normal(rng));
        for (t, pose) in truth.iter().enumerate() {
            errors = errors.map(|error| 0.7 * error + 0.71 * normal(rng));
            let Some(forearm) = vec3::unit(vec3::sub(pose[wrist], pose[elbow]), 1e-9) else { continue };
            let first = vec3::unit(vec3::across(axis, forearm), 1e-6).unwrap_or_else(|| vec3::any_across(forearm));
            let second = vec3::cross(forearm, first);
            let [a, b] = bends.each_ref().map(|(constant, swing)| constant + swing.at(t as f64 * frame_secs));
            let hand = vec3::add(forearm, vec3::add(vec3::scale(first, a), vec3::scale(second, b)));
            let [x, y, z] = vec3::scale(hand, 1.0 / vec3::norm(hand));
            let z = (slope * z + offset + deviation * errors[0]).clamp(-0.98, 0.98);
            let angle = y.atan2(x) + 0.09 * errors[1];
            let flat = (1.0 - z * z).sqrt();
            if !is_missing[t] {
                hands[t][side] = Some([flat * angle.cos(), flat * angle.sin(), z].map(|v| v as f32));
            }
        }
    }
    hands
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::scene::body_motion::gesture;
    use rand::SeedableRng;

    #[test]
    fn depth_of_hands_goes_with_that_of_forearms() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let (mut pairs, mut n_frames) = (Vec::new(), 0);
        for _ in 0..400 {
            let truth = gesture(&mut rng, 30, 1.0 / 15.0);
            n_frames += truth.len();
            for (pose, hands) in truth.iter().zip(observed(&truth, 1.0 / 15.0, &mut rng)) {
                let Some(hand) = hands[0] else { continue };
                assert!((hand.map(|v| v * v).iter().sum::<f32>() - 1.0).abs() < 1e-5);
                let forearm = vec3::unit(vec3::sub(pose[R_WRIST], pose[R_ELBOW]), 1e-9).unwrap();
                pairs.push([forearm[2], f64::from(hand[2])]);
            }
        }
        let n = pairs.len() as f64;
        let mean = [0, 1].map(|k| pairs.iter().map(|p| p[k]).sum::<f64>() / n);
        let moment = |a: usize, b: usize| pairs.iter().map(|p| (p[a] - mean[a]) * (p[b] - mean[b])).sum::<f64>() / n;
        let correlation = moment(0, 1) / (moment(0, 0) * moment(1, 1)).sqrt();
        let present = n / f64::from(n_frames as u32);
        assert!((0.6..0.9).contains(&correlation), "{correlation}");
        assert!((0.5..0.65).contains(&present), "{present}");
    }
}
