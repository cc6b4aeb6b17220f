//! SMPL-X (Pavlakos et al. 2019) rotations to joint positions: forward kinematics of the 55 joints on an assumed rest
//! pose, a T-pose with arms along x, y up, facing z, of an adult of 1.75 m with the reference hand's bones. The files
//! contain no rest pose; a person's own differs in proportions and by a few degrees, so that only directions are used.

use crate::mocap::smplx::rest_hand;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, scale, sub};
use orator_base::motion::fk::Skeleton;
use orator_base::motion::hand_bones::METRES;
use orator_base::types::skeleton::Side;

/// Number of joints with a rotation.
pub const N_SMPLX: usize = 55;
/// Number of finger tips, which follow the joints: index, middle, little, ring, thumb of the left, then the right hand.
const N_TIPS: usize = 10;
pub const HEAD: usize = 15;
/// Right, left.
pub const HIPS: [usize; 2] = [2, 1];
/// Shoulder, elbow, wrist of the right, then of the left arm.
pub const ARMS: [usize; 6] = [17, 19, 21, 16, 18, 20];
/// First finger joint of the left and the right hand.
const FINGERS: [usize; 2] = [25, 40];
/// Base of each finger in the file's order (index, middle, little, ring, thumb) among the 21 points of a hand.
const BASES: [usize; 5] = [5, 9, 17, 13, 1];

/// Parents of joints 1 to 54.
const PARENTS: [usize; N_SMPLX - 1] = [
    0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 15, 15, 15, // body, jaw, eyes
    20, 25, 26, 20, 28, 29, 20, 31, 32, 20, 34, 35, 20, 37, 38, // left fingers
    21, 40, 41, 21, 43, 44, 21, 46, 47, 21, 49, 50, 21, 52, 53, // right fingers
];
/// Offsets of joints 1 to 24 from their parents, metres. Right joints mirror the left ones.
const OFFSETS: [Vec3; 24] = [
    [0.09, -0.07, 0.0],
    [-0.09, -0.07, 0.0],
    [0.0, 0.11, 0.0],
    [0.0, -0.41, 0.0],
    [0.0, -0.41, 0.0],
    [0.0, 0.13, 0.0],
    [0.0, -0.41, 0.0],
    [0.0, -0.41, 0.0],
    [0.0, 0.06, 0.0],
    [0.0, -0.06, 0.13],
    [0.0, -0.06, 0.13],
    [0.0, 0.21, 0.0],
    [0.06, 0.16, 0.0],
    [-0.06, 0.16, 0.0],
    [0.0, 0.09, 0.0],
    [0.12, 0.0, 0.0],
    [-0.12, 0.0, 0.0],
    [0.28, 0.0, 0.0],
    [-0.28, 0.0, 0.0],
    [0.25, 0.0, 0.0],
    [-0.25, 0.0, 0.0],
    [0.0, 0.0, 0.02],
    [0.03, 0.06, 0.08],
    [-0.03, 0.06, 0.08],
];

/// The 55 joints in the order of the file, then the finger tips.
pub fn skeleton() -> Skeleton {
    let hands = [Side::Left, Side::Right].map(|side| rest_hand(side).map(|at| scale(at, METRES)));
    let offset = |joint: usize| match joint {
        0 => [0.0; 3],
        _ if joint < FINGERS[0] => OFFSETS[joint - 1],
        _ => {
            let side = usize::from(joint >= FINGERS[1]);
            let (finger, bone) = ((joint - FINGERS[side]) / 3, (joint - FINGERS[side]) % 3);
            let at = BASES[finger] + bone;
            if bone == 0 { hands[side][at] } else { sub(hands[side][at], hands[side][at - 1]) }
        }
    };
    let mut skeleton = Skeleton::default();
    for joint in 0..N_SMPLX {
        let parent = joint.checked_sub(1).map(|before| PARENTS[before]);
        skeleton.push(&format!("joint {joint}"), parent, offset(joint), false);
    }
    for (side, first) in FINGERS.into_iter().enumerate() {
        for (finger, base) in BASES.into_iter().enumerate() {
            let offset = sub(hands[side][base + 3], hands[side][base + 2]);
            skeleton.push("", Some(first + 3 * finger + 2), offset, true);
        }
    }
    skeleton
}

/// Local rotations of a frame from its axis-angle vectors, one per joint of `skeleton`.
pub fn local(vectors: &[Vec3; N_SMPLX]) -> Vec<Rotation> {
    let turns = vectors.iter().map(|&vector| Rotation::from_rotation_vector(vector));
    turns.chain([Rotation::IDENTITY; N_TIPS]).collect()
}

/// Joint (or tip) of `skeleton` for each of the points 1 to 20 of a hand (0 left, 1 right).
pub fn hand_points(side: usize) -> impl Iterator<Item = (usize, usize)> {
    let joint = move |finger: usize, bone: usize| match bone {
        3 => N_SMPLX + 5 * side + finger,
        _ => FINGERS[side] + 3 * finger + bone,
    };
    let fingers = BASES.into_iter().enumerate();
    fingers.flat_map(move |(finger, base)| (0..4).map(move |bone| (base + bone, joint(finger, bone))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_base::math::vec3::norm;
    use std::f64::consts::FRAC_PI_2;

    const LEFT_SHOULDER: usize = 16;
    const LEFT_ELBOW: usize = 18;
    const LEFT_WRIST: usize = 20;

    fn positions(turned: &[(usize, Vec3)]) -> Vec<Vec3> {
        let mut vectors = [[0.0; 3]; N_SMPLX];
        turned.iter().for_each(|&(joint, vector)| vectors[joint] = vector);
        skeleton().positions([0.0; 3], &local(&vectors))
    }

    fn assert_close(a: Vec3, b: Vec3) {
        assert!(norm(sub(a, b)) < 1e-12, "{a:?} {b:?}");
    }

    #[test]
    fn a_quarter_turn_of_the_shoulder_raises_the_arm_and_moves_nothing_else() {
        let (rest, raised) = (positions(&[]), positions(&[(LEFT_SHOULDER, [0.0, 0.0, FRAC_PI_2])]));
        assert_close(rest[LEFT_WRIST], [0.71, 0.46, 0.0]);
        assert_close(raised[LEFT_ELBOW], [0.18, 0.46 + 0.28, 0.0]);
        assert_close(raised[LEFT_WRIST], [0.18, 0.46 + 0.53, 0.0]);
        let mut moved: Vec<usize> = (0..raised.len()).filter(|&k| norm(sub(raised[k], rest[k])) > 1e-9).collect();
        let arm = [LEFT_ELBOW, LEFT_WRIST].into_iter().chain(25..40).chain(55..60);
        assert_eq!(moved, arm.collect::<Vec<_>>());
        // A rotation moves the children of its joint only.
        let bent = positions(&[(LEFT_ELBOW, [0.0, -FRAC_PI_2, 0.0])]);
        moved.retain(|&k| norm(sub(bent[k], rest[k])) < 1e-9);
        assert_eq!(moved, [LEFT_ELBOW]);
        assert_close(bent[LEFT_WRIST], [0.46, 0.46, 0.25]);
    }

    #[test]
    fn the_rotation_of_a_joint_applies_in_the_axes_of_its_parent() {
        // The shoulder's turn about z takes the elbow's axis -y to x, about which the forearm turns from y to z.
        let both = positions(&[(LEFT_SHOULDER, [0.0, 0.0, FRAC_PI_2]), (LEFT_ELBOW, [0.0, -FRAC_PI_2, 0.0])]);
        assert_close(both[LEFT_ELBOW], [0.18, 0.74, 0.0]);
        assert_close(both[LEFT_WRIST], [0.18, 0.74, 0.25]);
        // The opposite order would give a forearm that points up: Ry(-90) Rz(90) x = y.
        let hips = positions(&[(0, [0.0, FRAC_PI_2, 0.0]), (LEFT_SHOULDER, [0.0, 0.0, FRAC_PI_2])]);
        assert_close(hips[LEFT_WRIST], [0.0, 0.46 + 0.53, -0.18]);
    }

    #[test]
    fn every_finger_point_has_its_joint_and_the_hands_are_mirrored() {
        let rest = positions(&[]);
        for ((point, left), (other, right)) in hand_points(0).zip(hand_points(1)) {
            assert_eq!(point, other);
            let [x, y, z] = rest[right];
            assert_close(rest[left], [-x, y, z]);
            assert!(rest[left][0] > rest[LEFT_WRIST][0]);
        }
        let mut points: Vec<usize> = hand_points(0).map(|(point, _)| point).collect();
        points.sort_unstable();
        assert_eq!(points, (1..21).collect::<Vec<_>>());
    }
}
