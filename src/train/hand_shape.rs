//! Hands made by rule: bones of published mean lengths, joint angles within what joints allow, from every side.

use crate::motion::hand_bones::{BONES, FAN, direction};
use crate::motion::hand_view::Hand;
use crate::motion::rotation::Rotation;
use crate::motion::vec3;
use crate::types::pose2d::N_HAND;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// A right hand, metres, the wrist at 0, upright: fingers along -y, thumb towards +x, the palm facing -z.
pub fn draw(rng: &mut ChaCha8Rng) -> Hand {
    let size = 1.08e-3 * about(rng, 0.08);
    let palm = about(rng, 0.10);
    let mut hand: Hand = [[0.0; 3]; N_HAND];
    // open hands, fists and everything between; each finger goes its own way now and then
    let curl: f64 = rng.random_range(-0.1f64..1.0).max(0.0).powf(1.8);
    let spread: f64 = rng.random_range(-0.4..1.2);
    let own = if rng.random_bool(0.35) { 0.45 } else { 0.12 };
    for finger in 1..5 {
        let mut length = BONES[finger].map(|mm| mm * size * about(rng, 0.07));
        length[0] *= palm;
        let fan = (FAN[finger] + 3.0 * normal(rng)).to_radians();
        // the palm is hollow: its edges lie nearer to the viewer it faces
        let hollow = (0.02 + 0.05 * rng.random_range(0.0..1.0)) * ((finger as f64 - 2.3).abs() - 0.7).max(0.0);
        let base = direction(fan, hollow.asin());
        let curl = (curl + own * normal(rng)).clamp(-0.15, 1.1);
        let abduction = fan * (0.3 + 0.7 * spread * (1.0 - 0.6 * curl.max(0.0))) + 0.07 * normal(rng);
        let first = (80.0 * curl + 12.0 * normal(rng) + rng.random_range(-15.0..15.0)).clamp(-25.0, 92.0);
        let second = (100.0 * curl + 15.0 * normal(rng) + 8.0).clamp(-5.0, 112.0);
        let third = (second * rng.random_range(0.35..0.85)).clamp(-5.0, 80.0);
        let root = 1 + 4 * finger;
        hand[root] = vec3::scale(base, length[0]);
        let mut flexion = 0.0;
        for (k, bend) in [first, second, third].into_iter().enumerate() {
            flexion += bend.to_radians();
            hand[root + k + 1] = vec3::add(hand[root + k], vec3::scale(direction(abduction, flexion), length[k + 1]));
        }
    }
    thumb(&mut hand, size, rng);
    hand
}

/// The thumb roams widely: its saddle joint opens it sideways and lays it before the palm.
fn thumb(hand: &mut Hand, size: f64, rng: &mut ChaCha8Rng) {
    let length = BONES[0].map(|mm| mm * size * about(rng, 0.09));
    let base = direction((FAN[0] + 8.0 * normal(rng)).to_radians(), 0.25 + 0.15 * normal(rng));
    let aside = (38.0 + 20.0 * normal(rng)).clamp(-20.0, 85.0);
    let before = (28.0 + 22.0 * normal(rng)).clamp(-20.0, 80.0);
    let mut along = direction(aside.to_radians(), before.to_radians());
    // it bends across the palm, about an axis that is its own
    let across = vec3::unit([-1.0 + 0.4 * normal(rng), -0.1 + 0.4 * normal(rng), -0.5 + 0.4 * normal(rng)], 1e-6);
    let axis = across.and_then(|a| vec3::unit(vec3::cross(along, a), 1e-6)).unwrap_or([0.0, 0.0, 1.0]);
    hand[1] = vec3::scale(base, length[0]);
    for k in 0..3 {
        hand[k + 2] = vec3::add(hand[k + 1], vec3::scale(along, length[k + 1]));
        let bend: f64 = if k == 0 { rng.random_range(-12.0..60.0) } else { rng.random_range(-20.0..80.0) };
        along = Rotation::about(axis, bend.to_radians()).turn(along);
    }
}

/// Any turn, all equally likely (Shoemake 1992).
pub fn any_turn(rng: &mut ChaCha8Rng) -> Rotation {
    let axis = std::array::from_fn(|_| normal(rng));
    let w = normal(rng);
    let length = (w * w + vec3::dot(axis, axis)).sqrt().max(1e-12);
    Rotation { w: w / length, v: vec3::scale(axis, 1.0 / length) }
}

pub fn normal(rng: &mut ChaCha8Rng) -> f64 {
    rng.sample(StandardNormal)
}

/// 1 plus or minus a normal share.
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
            let hand = draw(&mut rng);
            assert!(hand[5][0] > hand[17][0], "the index is on the thumb's side");
            assert!(hand[9][1] < -0.05 && hand[9][1] > -0.16);
            thumb += usize::from(hand[2][0] > hand[17][0]);
            towards += usize::from((5..21).map(|j| hand[j][2]).sum::<f64>() < 0.0);
        }
        assert!(thumb > n * 19 / 20 && towards > n * 9 / 10, "{thumb} {towards}");
    }

    #[test]
    fn turns_are_turns() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for _ in 0..50 {
            let turned = any_turn(&mut rng).turn([3.0, 4.0, 12.0]);
            assert!((vec3::norm(turned) - 13.0).abs() < 1e-9);
        }
    }
}
