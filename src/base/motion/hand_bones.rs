//! A mean human hand: lengths of its bones, how the palm fans out, and the hand made of them at given joint angles. The angles that
//! hands take are defined in `train::scene::hand_shape`.

use super::view::hand::HandJoints;
use crate::math::vec3::{self, Vec3};
use crate::types::pose2d::N_HAND;

/// Bones of the thumb, index, middle, ring and little finger in mm: from the wrist to the first joint, then the
/// phalanges (thumb: metacarpal, two phalanges). Phalanges and metacarpals: Buryanov & Kotiuk 2010, table 2 (mean of
/// 66 adults), the last with 4 mm of fingertip; the wrist adds 22 mm to the metacarpals.
pub const BONES: [[f64; 4]; 5] = [
    [34.0, 46.2, 31.6, 25.7],
    [90.1, 39.8, 22.4, 19.8],
    [86.6, 44.6, 26.3, 21.4],
    [80.0, 41.4, 25.7, 21.3],
    [75.7, 32.7, 18.1, 20.0],
];
/// Angle of the first joints within the palm, degrees from the middle finger towards the thumb.
pub const FAN: [f64; 5] = [52.0, 15.0, 2.0, -11.0, -25.0];
/// The middle finger's first phalanx of a hand that errors are measured on, metres.
pub const PHALANX: f64 = 0.048;
/// Metres of such a hand for a millimetre of `BONES`.
pub const METRES: f64 = PHALANX / BONES[2][1];

/// A direction in a right hand that stands upright (fingers along -y, thumb towards +x, the palm facing -z): `aside`
/// radians from the fingers' towards the thumb, then raised by `flexion` towards where the palm faces.
pub fn direction(aside: f64, flexion: f64) -> Vec3 {
    [aside.sin() * flexion.cos(), -aside.cos() * flexion.cos(), -flexion.sin()]
}

/// Puts the joints of a finger on an upright right hand: the first at `root`, the others along phalanges of `lengths` 1 to
/// 3, each bent by so many radians more than the one before.
pub fn put_finger(hand: &mut HandJoints, finger: usize, root: Vec3, aside: f64, bends: [f64; 3], lengths: [f64; 4]) {
    let first = 1 + 4 * finger;
    hand[first] = root;
    let mut flexion = 0.0;
    for (k, bend) in bends.into_iter().enumerate() {
        flexion += bend;
        let phalanx = vec3::scale(direction(aside, flexion), lengths[k + 1]);
        hand[first + k + 1] = vec3::add(hand[first + k], phalanx);
    }
}

/// The upright right hand of mean bones at rest, metres, wrist at 0, its size that of measured hands: fingers bent a
/// little (20, 30 and 18 degrees), the thumb beside and somewhat before the palm.
pub fn relaxed() -> HandJoints {
    let mut hand: HandJoints = [[0.0; 3]; N_HAND];
    for finger in 0..5 {
        let fan = FAN[finger].to_radians();
        let (first, aside, bends) = match finger {
            0 => (direction(fan, 0.25), 38f64.to_radians(), [0.45, 0.15, 0.15]),
            _ => (direction(fan, 0.0), 0.5 * fan, [20f64, 30.0, 18.0].map(f64::to_radians)),
        };
        let lengths = BONES[finger].map(|mm| METRES * mm);
        put_finger(&mut hand, finger, vec3::scale(first, lengths[0]), aside, bends, lengths);
    }
    hand
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hand_at_rest_has_the_measured_size() {
        let hand = relaxed();
        assert!((vec3::norm(vec3::sub(hand[10], hand[9])) - PHALANX).abs() < 1e-12);
        assert!(hand[5][0] > hand[17][0] && hand[4][0] > hand[5][0] && hand[12][2] < 0.0);
    }
}
