//! The 55 joints of SMPL-X and the ten finger tips on a rest pose of this program: a T-pose with arms along x, y up,
//! facing z, of an adult of 1.75 m with the mean hand (`hand_bones`), flat and straight, the thumbs 45 degrees forward
//! and slightly down. A person's own rest pose (`betas`) differs in proportions and by a few degrees.

use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{self, Vec3, add, scale, sub};
use orator_base::motion::fk::Skeleton;
use orator_base::motion::hand_bones::{BONES, METRES};
use orator_base::types::pose2d::N_HAND;
use orator_base::types::skeleton::Side;

/// Number of joints with a rotation.
pub const N_SMPLX: usize = 55;
/// The joints, then the tips of index, middle, little and ring finger and thumb of the left, then of the right hand.
pub const N_POINTS: usize = N_SMPLX + 10;
/// Number of body joints, which SMPL-H has too; jaw and eyes follow, which it lacks.
pub const N_BODY: usize = 22;
/// First finger joint of the left and the right hand.
pub const FINGERS: [usize; 2] = [25, 40];
pub const HEAD: usize = 15;
/// Right, left.
pub const HIPS: [usize; 2] = [2, 1];
/// Shoulder, elbow, wrist of the right, then of the left arm.
pub const ARMS: [usize; 6] = [17, 19, 21, 16, 18, 20];
/// Left, right.
pub const WRISTS: [usize; 2] = [20, 21];
/// Joints of the legs below the hips.
pub(super) const LEGS: [usize; 4] = [4, 5, 7, 8];
/// Chest of our rig.
pub const CHEST: usize = 9;
/// Base of each finger in the file's order (index, middle, little, ring, thumb) among the 21 points of a hand.
const BASES: [usize; 5] = [5, 9, 17, 13, 1];
/// Directions of the fingers, degrees towards the thumb; thumb to little finger.
const FAN: [f64; 5] = [45.0, 8.0, 0.0, -12.0, -26.0];
/// Directions of the knuckles from the wrist, degrees towards the thumb; thumb to little finger.
const PALM: [f64; 5] = [48.0, 15.0, 1.0, -12.0, -25.0];
/// Position of the pelvis. As in the body models the origin is above it, so that the soles of a standing person are at 0
/// for a translation of 1.3 m, the mean of BEAT2.
const PELVIS: Vec3 = [0.0, -0.35, 0.0];

/// Names of the joints before the fingers as in BVH files, by which the joints of the body are matched.
const NAMES: &str = "Hips LeftUpLeg RightUpLeg Spine LeftLeg RightLeg Spine1 LeftFoot RightFoot Spine2 LeftToeBase \
    RightToeBase Neck LeftShoulder RightShoulder Head LeftArm RightArm LeftForeArm RightForeArm LeftHand RightHand Jaw \
    LeftEye RightEye";
const FINGER_NAMES: [&str; 5] = ["Index", "Middle", "Pinky", "Ring", "Thumb"];
/// Parents of joints 1 to 24.
const PARENTS: [usize; FINGERS[0] - 1] =
    [0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 15, 15, 15];
/// Offsets of joints 1 to 24 from their parents, metres. Right joints mirror the left ones.
#[rustfmt::skip]
const OFFSETS: [Vec3; FINGERS[0] - 1] = [
    [0.09, -0.07, 0.0], [-0.09, -0.07, 0.0], [0.0, 0.11, 0.0],
    [0.0, -0.41, 0.0], [0.0, -0.41, 0.0], [0.0, 0.13, 0.0],
    [0.0, -0.41, 0.0], [0.0, -0.41, 0.0], [0.0, 0.06, 0.0],
    [0.0, -0.06, 0.13], [0.0, -0.06, 0.13], [0.0, 0.21, 0.0],
    [0.06, 0.16, 0.0], [-0.06, 0.16, 0.0], [0.0, 0.09, 0.0],
    [0.12, 0.0, 0.0], [-0.12, 0.0, 0.0],
    [0.28, 0.0, 0.0], [-0.28, 0.0, 0.0],
    [0.25, 0.0, 0.0], [-0.25, 0.0, 0.0],
    [0.0, 0.0, 0.02], [0.03, 0.06, 0.08], [-0.03, 0.06, 0.08],
];

/// Positions of joints and tips at rest, metres, in the axes of the body model.
pub type RestPose = [Vec3; N_POINTS];

/// Finger of a joint or tip: side (0 left, 1 right), finger in the file's order, and bone (3 for the tip).
fn finger(point: usize) -> Option<(usize, usize, usize)> {
    match point {
        N_SMPLX.. => Some(((point - N_SMPLX) / 5, (point - N_SMPLX) % 5, 3)),
        _ if point < FINGERS[0] => None,
        _ => {
            let side = usize::from(point >= FINGERS[1]);
            Some((side, (point - FINGERS[side]) / 3, (point - FINGERS[side]) % 3))
        }
    }
}

/// Parent of a joint or tip; `None` for the pelvis.
pub fn parent(point: usize) -> Option<usize> {
    match finger(point) {
        Some((side, _, 0)) => Some(WRISTS[side]),
        Some((side, finger, 3)) => Some(FINGERS[side] + 3 * finger + 2),
        Some(_) => Some(point - 1),
        None => point.checked_sub(1).map(|before| PARENTS[before]),
    }
}

/// Name of a joint; that of a tip is empty.
pub fn name(joint: usize) -> String {
    match finger(joint) {
        Some((_, _, 3)) => String::new(),
        Some((side, finger, bone)) => {
            format!("{}Hand{}{}", ["Left", "Right"][side], FINGER_NAMES[finger], bone + 1)
        }
        None => NAMES.split(' ').nth(joint).unwrap_or_default().to_owned(),
    }
}

/// The rest pose of this program.
pub fn rest() -> RestPose {
    let hands = [Side::Left, Side::Right].map(rest_hand);
    let mut rest = [PELVIS; N_POINTS];
    for point in 1..N_POINTS {
        let from_wrist = |(side, finger, bone): (usize, usize, usize)| {
            add(rest[WRISTS[side]], scale(hands[side][BASES[finger] + bone], METRES))
        };
        let from_parent = || add(rest[PARENTS[point - 1]], OFFSETS[point - 1]);
        rest[point] = finger(point).map_or_else(from_parent, from_wrist);
    }
    rest
}

/// Joints of the rest hand in mm, relative to the wrist, thumb to little finger, each base to tip.
fn rest_hand(side: Side) -> [Vec3; N_HAND] {
    let direction = |degrees: f64, down: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let [x, y, z] = vec3::unit([cos, down, sin], 1e-9).unwrap_or_default();
        if side == Side::Left { [x, y, z] } else { [-x, y, z] }
    };
    let mut joints = [[0.0; 3]; N_HAND];
    for (row, bones) in BONES.iter().enumerate() {
        let (first, down) = (1 + 4 * row, if row == 0 { -0.25 } else { 0.0 });
        joints[first] = scale(direction(PALM[row], 1.5 * down), bones[0]);
        for k in 1..4 {
            joints[first + k] = add(joints[first + k - 1], scale(direction(FAN[row], 0.4 * down), bones[k]));
        }
    }
    joints
}

/// The joints in the order of the file, then the tips.
pub fn skeleton(rest: &RestPose) -> Skeleton {
    let mut skeleton = Skeleton::default();
    for point in 0..N_POINTS {
        let parent = parent(point);
        let offset = parent.map_or([0.0; 3], |parent| sub(rest[point], rest[parent]));
        skeleton.push(&name(point), parent, offset, point >= N_SMPLX);
    }
    skeleton
}

/// Local rotations of joints and tips.
pub fn local(rotations: &[Rotation; N_SMPLX]) -> Vec<Rotation> {
    rotations.iter().copied().chain([Rotation::IDENTITY; N_POINTS - N_SMPLX]).collect()
}

/// Joint (or tip) for each of the points 1 to 20 of a hand (0 left, 1 right).
pub fn hand_points(side: usize) -> impl Iterator<Item = (usize, usize)> {
    let points = (FINGERS[0]..N_POINTS).filter_map(|point| Some((finger(point)?, point)));
    points.filter(move |((of, ..), _)| *of == side).map(|((_, finger, bone), point)| (BASES[finger] + bone, point))
}
