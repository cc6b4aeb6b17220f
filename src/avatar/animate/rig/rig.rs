//! Rig that motion is applied to: a complete body in T-pose (y up, facing +z, palms down) from Hips to Head, with legs,
//! both arms and all fingers. Arms and hands have the motion's median bone lengths and palm shapes and are rigid;
//! trunk, head and legs, which the joints do not describe, are proportional to the arms. Lengths in cm.

use super::hinge::Hinge;
use crate::animate::solve::positions::{JointPositions, palm_frame};
use orator_base::math::order::upper_median;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, across, cross, dot, norm, scale};
use orator_base::motion::fk::Skeleton;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{self, L_ELBOW, L_HAND, L_SHOULDER, L_WRIST, N_JOINTS, NECK, R_HAND};
use std::collections::BTreeMap;

/// Centimetres per metre.
pub const CM: f64 = 100.0;
/// Length of upper arm plus forearm for the trunk and leg proportions below, metres.
const ARM_METRES: f64 = 0.55;
const FINGERS: [&str; 5] = ["Thumb", "Index", "Middle", "Ring", "Pinky"];
/// Default bone lengths of the left side, metres: joints 4..=6, then the hand 8..=27.
const DEFAULT_ARM: [f64; 3] = [0.165, 0.30, 0.25];
const DEFAULT_FINGERS: [[f64; 4]; 5] = [
    [0.030, 0.038, 0.030, 0.025],
    [0.080, 0.042, 0.026, 0.022],
    [0.078, 0.046, 0.029, 0.023],
    [0.073, 0.043, 0.027, 0.023],
    [0.070, 0.034, 0.020, 0.020],
];
/// Default direction of a finger's base: degrees from the axis of the hand towards the thumb.
const SPREAD_DEGREES: [f64; 5] = [50.0, 16.0, 5.0, -6.0, -17.0];
/// Minimum cosine between a metacarpal and the axis of the hand (60 degrees); the default palm has at most 17 degrees.
const MIN_METACARPAL_COS: f64 = 0.5;
/// Ratio of a bone's length without noise to its median length: minimum, and the ratio below which it is used.
const MIN_LENGTH_RATIO: f64 = 0.5;
const NOISE_LENGTH_RATIO: f64 = 0.99;
/// Number of frames over which the products are averaged.
const NOISE_FRAMES: usize = 12;
/// Directions of the left thumb at rest and towards which it flexes, close to the medians of speakers' hands.
const THUMB_ALONG: Vec3 = [0.74, -0.35, 0.57];
const THUMB_FLEXION: Vec3 = [0.0, -0.5, -0.87];
const X: Vec3 = [1.0, 0.0, 0.0];

/// Joint indices of one arm in the skeleton.
#[derive(Clone, Debug)]
pub struct RigArm {
    /// +1 for left, -1 for right: the sign of x.
    pub sign: f64,
    pub clavicle: usize,
    pub upper: usize,
    pub forearm: usize,
    pub hand: usize,
    /// Thumb to little finger, three phalanges each.
    pub fingers: [[usize; 3]; 5],
}

/// Skeleton with the roles of its joints.
#[derive(Clone, Debug)]
pub struct Rig {
    pub skeleton: Skeleton,
    /// Position of the hips, cm; the soles are at y = 0.
    pub root: Vec3,
    pub spine: usize,
    pub chest: usize,
    pub neck: usize,
    pub head: usize,
    /// Left, right.
    pub arms: [RigArm; 2],
    /// Left, right: upper leg, lower leg, foot, end of the foot.
    pub legs: [[usize; 4]; 2],
    /// Joint of the skeleton at the position of each of a motion's 49 joints (bone ends included).
    pub positions: [usize; N_JOINTS],
    /// World rotations of joints whose rest pose in a capture differs from that of the rig.
    pub rest: BTreeMap<usize, Rotation>,
}

impl Rig {
    /// Rig for a motion: bone lengths and palms are medians over its frames. An implausible palm is replaced by that of
    /// the other hand, or by a flat one with metacarpals of the same lengths.
    pub fn from_motion(motion: &Motion) -> Self {
        let (positions, metres) = (JointPositions::from_motion(motion), bone_metres(motion));
        let [left, right] = [median_palm(&positions), median_palm(&positions.mirrored())];
        let palms = [left.or(right), right.or(left)].map(|palm| palm.unwrap_or_else(|| default_palm(&metres)));
        Self::with_measures(&metres, &palms)
    }

    /// Rig with given bone lengths in metres (entry `j`: from joint `j` to its parent) and palms: the positions of the
    /// finger bases in the hand's frame, metres, left and right, the right one mirrored.
    pub fn with_measures(metres: &[f64; N_JOINTS], palms: &[[Vec3; 5]; 2]) -> Self {
        let arm = |shoulder: usize| metres[shoulder + 1] + metres[shoulder + 2];
        let body = (arm(L_SHOULDER) + arm(skeleton::R_SHOULDER)) / 2.0 / ARM_METRES * CM;
        let mut bones = Skeleton::default();
        let mut positions = [0; N_JOINTS];
        let up = |share: f64| [0.0, share * body, 0.0];

        let hips = bones.push("Hips", None, [0.0; 3], false);
        let spine = bones.push("Spine", Some(hips), up(0.10), false);
        let chest = bones.push("Chest", Some(spine), up(0.19), false);
        let neck = bones.push("Neck", Some(chest), up(0.21), false);
        let head = bones.push("Head", Some(neck), up(0.11), false);
        bones.push("", Some(head), up(0.20), true);
        positions[NECK] = neck;
        let arms = [(1.0, &palms[0]), (-1.0, &palms[1])]
            .map(|(sign, palm)| push_arm(&mut bones, &mut positions, (metres, palm), chest, up(0.21), sign));
        let legs = [(1.0, "Left"), (-1.0, "Right")].map(|(sign, side)| {
            let from_hips = [sign * 0.09 * body, -0.04 * body, 0.0];
            let upper = bones.push(&format!("{side}UpLeg"), Some(hips), from_hips, false);
            let lower = bones.push(&format!("{side}Leg"), Some(upper), up(-0.42), false);
            let foot = bones.push(&format!("{side}Foot"), Some(lower), up(-0.42), false);
            [upper, lower, foot, bones.push("", Some(foot), [0.0, -0.08 * body, 0.16 * body], true)]
        });
        let (root, rest) = (up(0.04 + 0.42 + 0.42 + 0.08), BTreeMap::new());
        Self { skeleton: bones, root, spine, chest, neck, head, arms, legs, positions, rest }
    }
}

fn push_arm(
    bones: &mut Skeleton,
    positions: &mut [usize; N_JOINTS],
    (metres, palm): (&[f64; N_JOINTS], &[Vec3; 5]),
    chest: usize,
    neck: Vec3,
    sign: f64,
) -> RigArm {
    let (side, shoulder, hand_root) =
        if sign > 0.0 { ("Left", L_SHOULDER, L_HAND) } else { ("Right", skeleton::R_SHOULDER, R_HAND) };
    let on_side = |[x, y, z]: Vec3| [sign * x, y, z];
    let bone = |joint: usize, direction: Vec3| on_side(scale(direction, metres[joint] * CM));
    let clavicle = bones.push(&format!("{side}Shoulder"), Some(chest), neck, false);
    let upper = bones.push(&format!("{side}Arm"), Some(clavicle), bone(shoulder, X), false);
    let forearm = bones.push(&format!("{side}ForeArm"), Some(upper), bone(shoulder + 1, X), false);
    let hand = bones.push(&format!("{side}Hand"), Some(forearm), bone(shoulder + 2, X), false);
    positions[shoulder] = upper;
    positions[shoulder + 1] = forearm;
    positions[shoulder + 2] = hand;
    positions[hand_root] = hand;
    let mut fingers = [[0; 3]; 5];
    for (finger, name) in FINGERS.iter().enumerate() {
        let base = hand_root + 1 + 4 * finger;
        let mut parent = hand;
        for k in 0..4 {
            let offset =
                if k == 0 { on_side(scale(palm[finger], CM)) } else { bone(base + k, finger_hinge(finger).along()) };
            let end = k == 3;
            let label = if end { String::new() } else { format!("{side}Hand{name}{}", k + 1) };
            parent = bones.push(&label, Some(parent), offset, end);
            positions[base + k] = parent;
            if !end {
                fingers[finger][k] = parent;
            }
        }
    }
    RigArm { sign, clavicle, upper, forearm, hand, fingers }
}

/// Hinge of a finger's joints in the axes of the left hand: the four fingers point along x and flex about the knuckle
/// line, the thumb flexes across the palm.
pub fn finger_hinge(finger: usize) -> Hinge {
    if finger > 0 {
        return Hinge::new(X, [0.0, 0.0, -1.0]);
    }
    let along = scale(THUMB_ALONG, 1.0 / norm(THUMB_ALONG));
    let bends = across(THUMB_FLEXION, along);
    Hinge::new(along, scale(cross(along, bends), 1.0 / norm(bends)))
}

/// Medians over frames of the finger bases in the left hand's frame, metres; `None` if never detected or implausible.
fn median_palm(positions: &JointPositions) -> Option<[Vec3; 5]> {
    let seen: Vec<_> = (0..positions.n_frames()).filter_map(|t| positions.palm(t)).collect();
    let middle = |finger: usize, axis: usize| upper_median(seen.iter().filter_map(|palm| Some(palm[finger]?[axis])));
    let mut palm = [[0.0; 3]; 5];
    for (finger, base) in palm.iter_mut().enumerate() {
        for (axis, place) in base.iter_mut().enumerate() {
            *place = middle(finger, axis)?;
        }
    }
    // The result is expressed in the frame of its own knuckles, as the palms of single frames are.
    let from_palm = palm_frame(&palm)?.inverse();
    Some(palm.map(|base| from_palm.turn(base))).filter(is_palm)
}

/// Whether the four metacarpals other than the thumb's point along the hand. A hardly trained network may produce
/// others, for which the mesh of the hand would be torn.
fn is_palm(palm: &[Vec3; 5]) -> bool {
    palm[1..].iter().all(|base| base[0] >= MIN_METACARPAL_COS * norm(*base))
}

/// Flat palm with metacarpals of these lengths.
fn default_palm(metres: &[f64; N_JOINTS]) -> [Vec3; 5] {
    std::array::from_fn(|finger| {
        let (sin, cos) = SPREAD_DEGREES[finger].to_radians().sin_cos();
        scale([cos, 0.0, sin], metres[L_HAND + 1 + 4 * finger])
    })
}

/// Median length over frames of the bone to each joint, metres; if never detected, the other side's or a default. Noise
/// lengthens short bones; where it does, products of different frames are used, whose errors are independent.
pub fn bone_metres(motion: &Motion) -> [f64; N_JOINTS] {
    let seen: [Option<f64>; N_JOINTS] = std::array::from_fn(|joint| {
        let parent = skeleton::parent(joint)?;
        let bone = |frame: ndarray::ArrayView2<f32>| -> Vec3 {
            std::array::from_fn(|k| f64::from(frame[[joint, k]]) - f64::from(frame[[parent, k]]))
        };
        let bones: Vec<Vec3> = motion.joints.outer_iter().map(bone).collect();
        let length = upper_median(bones.iter().map(|&bone| norm(bone)))?;
        // For a bone that turns evenly the rotation between the frames cancels out.
        let square = |run: &[Vec3]| (4.0 * dot(run[0], run[1]) - dot(run[0], run[2])) / 3.0;
        let mean = |run: &[Vec3]| run.windows(3).map(square).sum::<f64>() / (NOISE_FRAMES - 2) as f64;
        let without_noise = upper_median(bones.windows(NOISE_FRAMES).map(mean))
            .map_or(length, |square| square.sqrt().max(length * MIN_LENGTH_RATIO));
        Some(if without_noise < NOISE_LENGTH_RATIO * length { without_noise } else { length })
    });
    std::array::from_fn(|joint| seen[joint].or(seen[skeleton::mirror(joint)]).unwrap_or_else(|| default_metres(joint)))
}

fn default_metres(joint: usize) -> f64 {
    let left = if skeleton::side(joint) == skeleton::Side::Right { skeleton::mirror(joint) } else { joint };
    match left {
        L_SHOULDER | L_ELBOW | L_WRIST => DEFAULT_ARM[left - L_SHOULDER],
        _ if left > L_HAND => DEFAULT_FINGERS[(left - L_HAND - 1) / 4][(left - L_HAND - 1) % 4],
        _ => 0.0,
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn default_rig() -> Rig {
        let missing = ndarray::Array3::from_elem((1, N_JOINTS, 3), f32::NAN);
        Rig::from_motion(&Motion::from_joints(orator_base::types::time::FrameRate::new(15, 1), missing))
    }

    #[test]
    fn a_plausible_palm_points_along_the_hand() {
        let metres: [f64; N_JOINTS] = std::array::from_fn(default_metres);
        assert!(is_palm(&default_palm(&metres)));
        // Medians of a network's output after 30 training steps: the base of the little finger is behind the wrist.
        let star = [
            [0.021, -0.029, 0.002],
            [0.064, -0.019, 0.061],
            [0.085, 0.002, -0.024],
            [0.080, -0.002, 0.024],
            [-0.040, -0.019, -0.063],
        ];
        assert!(!is_palm(&star));
    }
}
