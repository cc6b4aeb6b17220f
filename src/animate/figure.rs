//! The figure that motion is put on: a whole body in T-pose (y up, facing +z, palms down), Hips to Head, fixed legs,
//! both arms with all fingers. Its arms and hands have the motion's own bone lengths; trunk, head and legs, which no
//! joint of ours tells of, are in proportion to the arms. Lengths in cm. A finger's metacarpal starts at the wrist
//! (`LeftInHandIndex`): our joints do not hold the palm rigid, and the figure follows them exactly.

use crate::motion::fk::Skeleton;
use crate::motion::vec3::{Vec3, scale};
use crate::types::pose3d::Motion;
use crate::types::skeleton::{self, L_ELBOW, L_HAND, L_SHOULDER, L_WRIST, N_JOINTS, NECK, R_HAND};

const CM: f64 = 100.0;
/// Upper arm and forearm of the body whose trunk and legs are given below, metres.
const ARM_METRES: f64 = 0.55;
const FINGERS: [&str; 5] = ["Thumb", "Index", "Middle", "Ring", "Pinky"];
/// Bone lengths of a left side where the motion never shows them, metres: joints 4..=6, then the hand 8..=27.
const DEFAULT_ARM: [f64; 3] = [0.165, 0.30, 0.25];
const DEFAULT_FINGERS: [[f64; 4]; 5] = [
    [0.030, 0.038, 0.030, 0.025],
    [0.080, 0.042, 0.026, 0.022],
    [0.078, 0.046, 0.029, 0.023],
    [0.073, 0.043, 0.027, 0.023],
    [0.070, 0.034, 0.020, 0.020],
];
/// Where a metacarpal points at rest: degrees from the hand's axis towards the thumb's side.
const SPREAD_DEGREES: [f64; 5] = [50.0, 16.0, 5.0, -6.0, -17.0];
/// The same for the thumb's phalanges.
const THUMB_DEGREES: f64 = 35.0;

/// One arm: indices of its joints in the skeleton.
#[derive(Clone, Debug)]
pub struct Arm {
    /// +1 left, -1 right: the sign of x.
    pub sign: f64,
    /// First of the motion's joints of this arm (its shoulder) and of its hand (the hand root).
    pub shoulder: usize,
    pub hand_root: usize,
    pub clavicle: usize,
    pub upper: usize,
    pub fore: usize,
    pub hand: usize,
    /// Thumb to little finger: metacarpal and three phalanges.
    pub fingers: [[usize; 4]; 5],
}

impl Arm {
    /// Along the arm at rest.
    pub fn along(&self) -> Vec3 {
        [self.sign, 0.0, 0.0]
    }
}

/// The skeleton with the meaning of its joints.
#[derive(Clone, Debug)]
pub struct Figure {
    pub skeleton: Skeleton,
    /// Where the hips stand, cm; the soles at y = 0.
    pub root: Vec3,
    pub spine: usize,
    pub chest: usize,
    /// Left, right.
    pub arms: [Arm; 2],
    /// For each of the 49 joints of a motion the joint of the skeleton at its place (ends of bones included).
    pub places: [usize; N_JOINTS],
}

impl Figure {
    /// The figure for a motion: bone lengths are medians over its frames.
    pub fn of(motion: &Motion) -> Self {
        Self::with_lengths(&bone_metres(motion))
    }

    /// The figure with given bone lengths in metres; entry `j` is the bone from joint `j` to its parent.
    pub fn with_lengths(metres: &[f64; N_JOINTS]) -> Self {
        let arm = |shoulder: usize| metres[shoulder + 1] + metres[shoulder + 2];
        let body = (arm(L_SHOULDER) + arm(skeleton::R_SHOULDER)) / 2.0 / ARM_METRES * CM;
        let mut bones = Skeleton::default();
        let mut places = [0; N_JOINTS];
        let up = |share: f64| [0.0, share * body, 0.0];

        let hips = bones.push("Hips", None, [0.0; 3], false);
        let spine = bones.push("Spine", Some(hips), up(0.10), false);
        let chest = bones.push("Chest", Some(spine), up(0.19), false);
        let neck = bones.push("Neck", Some(chest), up(0.21), false);
        let head = bones.push("Head", Some(neck), up(0.11), false);
        bones.push("", Some(head), up(0.20), true);
        places[NECK] = neck;
        let arms = [(1.0, "Left"), (-1.0, "Right")]
            .map(|(sign, side)| push_arm(&mut bones, &mut places, metres, chest, up(0.21), sign, side));
        for (sign, side) in [(1.0, "Left"), (-1.0, "Right")] {
            let from_hips = [sign * 0.09 * body, -0.04 * body, 0.0];
            let upper = bones.push(&format!("{side}UpLeg"), Some(hips), from_hips, false);
            let lower = bones.push(&format!("{side}Leg"), Some(upper), up(-0.42), false);
            let foot = bones.push(&format!("{side}Foot"), Some(lower), up(-0.42), false);
            bones.push("", Some(foot), [0.0, -0.08 * body, 0.16 * body], true);
        }
        Self { skeleton: bones, root: up(0.04 + 0.42 + 0.42 + 0.08), spine, chest, arms, places }
    }
}

fn push_arm(
    bones: &mut Skeleton,
    places: &mut [usize; N_JOINTS],
    metres: &[f64; N_JOINTS],
    chest: usize,
    neck: Vec3,
    sign: f64,
    side: &str,
) -> Arm {
    let (shoulder, hand_root) = if sign > 0.0 { (L_SHOULDER, L_HAND) } else { (skeleton::R_SHOULDER, R_HAND) };
    let bone = |joint: usize, direction: Vec3| scale(direction, metres[joint] * CM);
    let along = [sign, 0.0, 0.0];
    let clavicle = bones.push(&format!("{side}Shoulder"), Some(chest), neck, false);
    let upper = bones.push(&format!("{side}Arm"), Some(clavicle), bone(shoulder, along), false);
    let fore = bones.push(&format!("{side}ForeArm"), Some(upper), bone(shoulder + 1, along), false);
    let hand = bones.push(&format!("{side}Hand"), Some(fore), bone(shoulder + 2, along), false);
    places[shoulder] = upper;
    places[shoulder + 1] = fore;
    places[shoulder + 2] = hand;
    places[hand_root] = hand;
    let mut fingers = [[0; 4]; 5];
    for (finger, name) in FINGERS.iter().enumerate() {
        let base = hand_root + 1 + 4 * finger;
        let mut parent = bones.push(&format!("{side}InHand{name}"), Some(hand), [0.0; 3], false);
        fingers[finger][0] = parent;
        for k in 0..4 {
            let offset = bone(base + k, rest_direction(finger, k, sign));
            let end = k == 3;
            let label = if end { String::new() } else { format!("{side}Hand{name}{}", k + 1) };
            parent = bones.push(&label, Some(parent), offset, end);
            places[base + k] = parent;
            if !end {
                fingers[finger][k + 1] = parent;
            }
        }
    }
    Arm { sign, shoulder, hand_root, clavicle, upper, fore, hand, fingers }
}

/// Where bone `k` of a finger (0: metacarpal) points in the T-pose.
pub fn rest_direction(finger: usize, k: usize, sign: f64) -> Vec3 {
    let degrees: f64 = match (finger, k) {
        (_, 0) => SPREAD_DEGREES[finger],
        (0, _) => THUMB_DEGREES,
        _ => 0.0,
    };
    let (sin, cos) = degrees.to_radians().sin_cos();
    [sign * cos, 0.0, sin]
}

/// Median length over the frames of the bone to each joint, metres; defaults in proportion where never seen.
pub fn bone_metres(motion: &Motion) -> [f64; N_JOINTS] {
    let mut metres = [0.0; N_JOINTS];
    for joint in 1..N_JOINTS {
        let Some(parent) = skeleton::parent(joint) else { continue };
        let mut seen: Vec<f64> = motion
            .joints
            .outer_iter()
            .map(|frame| {
                let square = |k| (f64::from(frame[[joint, k]]) - f64::from(frame[[parent, k]])).powi(2);
                (0..3).map(square).sum::<f64>().sqrt()
            })
            .filter(|length| length.is_finite())
            .collect();
        if seen.is_empty() {
            metres[joint] = default_metres(joint);
        } else {
            let middle = seen.len() / 2;
            metres[joint] = *seen.select_nth_unstable_by(middle, f64::total_cmp).1;
        }
    }
    metres
}

fn default_metres(joint: usize) -> f64 {
    let left = if skeleton::side(joint) == skeleton::Side::Right { skeleton::mirror(joint) } else { joint };
    match left {
        L_SHOULDER | L_ELBOW | L_WRIST => DEFAULT_ARM[left - L_SHOULDER],
        _ if left > L_HAND => DEFAULT_FINGERS[(left - L_HAND - 1) / 4][(left - L_HAND - 1) % 4],
        _ => 0.0,
    }
}
