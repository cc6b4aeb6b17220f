//! A mean human hand: bone lengths, the spread of the fingers in the palm, and the hand at given joint angles. The
//! joint angles of plausible hands are defined in `train::scene::hand_shape`.

use super::view::hand::HandJoints;
use crate::math::vec3::{self, Vec3};
use crate::types::pose2d::N_HAND;

/// Bones of the thumb, index, middle, ring and little finger in mm: from the wrist to the first joint, then the
/// phalanges (thumb: metacarpal, two phalanges). Source of phalanges and metacarpals: Buryanov & Kotiuk 2010, table 2
/// (mean of 66 adults); the last phalanx includes 4 mm of fingertip, and the wrist adds 22 mm to the metacarpals.
pub const BONES: [[f64; 4]; 5] = [
    [34.0, 46.2, 31.6, 25.7],
    [90.1, 39.8, 22.4, 19.8],
    [86.6, 44.6, 26.3, 21.4],
    [80.0, 41.4, 25.7, 21.3],
    [75.7, 32.7, 18.1, 20.0],
];
/// Angle of the first joints within the palm, in degrees from the middle finger towards the thumb.
pub const FAN: [f64; 5] = [52.0, 15.0, 2.0, -11.0, -25.0];
/// First phalanx of the middle finger of the hand on which errors are measured, metres.
pub const PHALANX: f64 = 0.048;
/// Metres per millimetre of `BONES` that scale the mean hand to `PHALANX`.
pub const METRES: f64 = PHALANX / BONES[2][1];

/// Returns a direction in an upright right hand (fingers along -y, thumb towards +x, palm facing -z): `aside` radians
/// from the fingers' direction towards the thumb, then raised by `flexion` radians towards the palm side.
pub fn direction(aside: f64, flexion: f64) -> Vec3 {
    [aside.sin() * flexion.cos(), -aside.cos() * flexion.cos(), -flexion.sin()]
}

/// Places the joints of a finger on an upright right hand: the first at `root`, the others along the phalanges
/// `lengths[1..]`, each bent by its angle in `bends` (radians) relative to the one before.
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

/// Returns the upright right hand of mean bones in a relaxed pose, in metres, with the wrist at 0 and the first
/// phalanx of the middle finger of length `PHALANX`: the fingers are slightly bent (20, 30 and 18 degrees), the thumb
/// is beside and slightly in front of the palm.
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
