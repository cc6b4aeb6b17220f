//! Random hand shapes: published mean bone lengths and joint angles within anatomical limits.

use orator_base::math::rotation::Rotation;
use orator_base::math::vec3;
use orator_base::math::vec3::Vec3;
use orator_base::motion::hand_bones::{BONES, FAN, direction, put_finger};
use orator_base::motion::view::hand::HandJoints;
use orator_base::types::pose2d::N_HAND;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// A right hand, metres, the wrist at 0, upright: fingers along -y, thumb towards +x, the palm facing -z.
pub fn sample_shape(rng: &mut ChaCha8Rng) -> HandJoints {
    let size = 1.08e-3 * about(rng, 0.08);
    let palm = about(rng, 0.12);
    let mut hand: HandJoints = [[0.0; 3]; N_HAND];
    let style = FingerStyle::sample(rng);
    // The palm is concave: its edges lie nearer to a viewer that it faces.
    let hollow = rng.random_range(0.0..0.07);
    for finger in 1..5 {
        let mut length = BONES[finger].map(|mm| mm * size * about(rng, 0.07));
        length[0] *= palm;
        let fan = (FAN[finger] + 3.0 * normal(rng)).to_radians();
        let edge = ((finger as f64 - 2.3).abs() - 0.7).max(0.0);
        let root = vec3::scale(direction(fan, (hollow * edge + 0.015 * normal(rng)).asin()), length[0]);
        let (abduction, bends) = style.finger(finger, fan, rng);
        put_finger(&mut hand, finger, root, abduction, bends.map(f64::to_radians), length);
    }
    thumb(&mut hand, size, rng);
    // Annotators and detectors do not agree on one wrist point.
    let wrist: Vec3 = [4.0, 6.0, 3.0].map(|mm| 1e-3 * mm * normal(rng));
    hand.iter_mut().skip(1).for_each(|p| *p = vec3::sub(*p, wrist));
    hand
}

/// Parameters common to the four fingers, which are moved together by the forearm's muscles.
struct FingerStyle {
    /// 0 straight, 1 a fist.
    curl: f64,
    /// Increase of the curl from finger to finger, away from the thumb.
    slope: f64,
    /// Standard deviation of each finger's own curl.
    own: f64,
    /// Extra bend in degrees of all first and of all second joints: flat hands bent at the knuckles, hooked fingers.
    more: [f64; 2],
    /// Finger spread relative to the fan of the metacarpals: below 0 crossed, 1 spread.
    spread: f64,
}

impl FingerStyle {
    fn sample(rng: &mut ChaCha8Rng) -> Self {
        Self {
            curl: rng.random_range(-0.1f64..1.0).max(0.0).powf(1.8),
            slope: 0.04 + 0.08 * normal(rng),
            own: if rng.random_bool(0.3) { 0.4 } else { 0.08 },
            more: [15.0 * normal(rng), 12.0 * normal(rng)],
            spread: rng.random_range(-0.4..1.2),
        }
    }

    /// Abduction in radians and the three bends in degrees.
    fn finger(&self, finger: usize, fan: f64, rng: &mut ChaCha8Rng) -> (f64, [f64; 3]) {
        let curl = self.curl + self.slope * (finger as f64 - 2.5) + self.own * normal(rng);
        let curl = curl.clamp(-0.15, 1.1);
        let abduction = fan * (0.3 + 0.7 * self.spread * (1.0 - 0.6 * curl.max(0.0))) + 0.07 * normal(rng);
        let first = (80.0 * curl + self.more[0] + 9.0 * normal(rng)).clamp(-30.0, 95.0);
        let second = (100.0 * curl + self.more[1] + 12.0 * normal(rng) + 8.0).clamp(-8.0, 112.0);
        let third = (second * rng.random_range(0.25..0.85) + 6.0 * normal(rng)).clamp(-15.0, 80.0);
        (abduction, [first, second, third])
    }
}

/// Samples the thumb; its saddle joint allows wide abduction and opposition.
fn thumb(hand: &mut HandJoints, size: f64, rng: &mut ChaCha8Rng) {
    let mut length = BONES[0].map(|mm| mm * size * about(rng, 0.10));
    length[0] *= about(rng, 0.15);
    let base = direction((FAN[0] + 12.0 * normal(rng)).to_radians(), 0.28 + 0.2 * normal(rng));
    let aside = (36.0 + 20.0 * normal(rng)).clamp(-20.0, 85.0);
    let before = (26.0 + 22.0 * normal(rng)).clamp(-20.0, 80.0);
    let mut along = direction(aside.to_radians(), before.to_radians());
    // The thumb bends across the palm about a random axis.
    let across = vec3::unit([-1.0 + 0.4 * normal(rng), -0.1 + 0.4 * normal(rng), -0.5 + 0.4 * normal(rng)], 1e-6);
    let axis = across.and_then(|a| vec3::unit(vec3::cross(along, a), 1e-6)).unwrap_or([0.0, 0.0, 1.0]);
    hand[1] = vec3::scale(base, length[0]);
    for k in 0..3 {
        hand[k + 2] = vec3::add(hand[k + 1], vec3::scale(along, length[k + 1]));
        let bend: f64 = if k == 0 { rng.random_range(-12.0..55.0) } else { rng.random_range(-25.0..75.0) };
        along = Rotation::about(axis, bend.to_radians()).turn(along);
    }
}

/// Uniformly distributed random rotation (Shoemake 1992).
pub fn random_rotation(rng: &mut ChaCha8Rng) -> Rotation {
    let axis = std::array::from_fn(|_| normal(rng));
    let w = normal(rng);
    let length = (w * w + vec3::dot(axis, axis)).sqrt().max(1e-12);
    Rotation { w: w / length, v: vec3::scale(axis, 1.0 / length) }
}

pub fn normal(rng: &mut ChaCha8Rng) -> f64 {
    rng.sample(StandardNormal)
}

/// Factor 1 + N(0, `share`), clamped to 0.6..1.5.
fn about(rng: &mut ChaCha8Rng, share: f64) -> f64 {
    (1.0 + share * normal(rng)).clamp(0.6, 1.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn it_is_a_right_hand_whose_fingers_close_to_the_palm() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let (mut thumb, mut towards, n) = (0, 0, 400);
        for _ in 0..n {
            let hand = sample_shape(&mut rng);
            assert!(hand[5][0] > hand[17][0], "the index is on the thumb's side");
            assert!(hand[9][1] < -0.035 && hand[9][1] > -0.18);
            thumb += usize::from(hand[2][0] > hand[17][0]);
            towards += usize::from((5..21).map(|j| hand[j][2]).sum::<f64>() < 0.0);
        }
        assert!(thumb > n * 19 / 20 && towards > n * 17 / 20, "{thumb} {towards}");
    }

    #[test]
    fn turns_are_turns() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for _ in 0..50 {
            let turned = random_rotation(&mut rng).turn([3.0, 4.0, 12.0]);
            assert!((vec3::norm(turned) - 13.0).abs() < 1e-9);
        }
    }
}
