//! Body of the drawn figure: controls (wrists, rotation and curl of the hands, lean of torso and head) to joints in
//! metres. World axes are those of a frontal camera: x to the figure's left (image right), y down, z away from the
//! viewer; the figure faces -z with its neck near the origin.

use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, cross, dot, norm, scale, sub};
use orator_base::types::skeleton::{L_HAND, L_SHOULDER, N_HAND_JOINTS, N_JOINTS, NECK, R_HAND, R_SHOULDER};

/// Bone lengths of an adult, metres.
pub const SHOULDER_WIDTH: f64 = 0.35;
pub const UPPER_ARM: f64 = 0.29;
pub const FOREARM: f64 = 0.25;
/// Nose, left and right eye, left and right ear relative to the neck, metres; the nose is at a distance of 0.21 m.
const HEAD: [Vec3; 5] =
    [[0.0, -0.19, -0.09], [0.034, -0.23, -0.07], [-0.034, -0.23, -0.07], [0.078, -0.205, 0.01], [-0.078, -0.205, 0.01]];
/// Centre of the head's rotation.
const SKULL_BASE: Vec3 = [0.0, -0.08, 0.02];
/// Left and right hip relative to the neck.
const HIPS: [Vec3; 2] = [[0.11, 0.5, 0.02], [-0.11, 0.5, 0.02]];
/// First joints of thumb to little finger relative to the wrist, in hand axes: along the fingers, towards the thumb,
/// out of the palm; metres.
pub const FINGER_BASES: [Vec3; 5] =
    [[0.026, 0.028, 0.012], [0.09, 0.026, 0.0], [0.094, 0.003, 0.0], [0.087, -0.018, 0.0], [0.078, -0.037, 0.003]];
/// Lengths of the three bones of each finger beyond its base, metres.
pub const PHALANGES: [[f64; 3]; 5] =
    [[0.044, 0.034, 0.028], [0.044, 0.027, 0.021], [0.048, 0.03, 0.022], [0.044, 0.028, 0.022], [0.036, 0.021, 0.019]];

/// Direction of the elbows in torso axes: outwards, down, away. It puts the elbows 0.27 m beside and below the neck
/// and almost in its plane, as measured on speakers of talks.
const ELBOW_POLE: [f64; 3] = [0.3, 0.95, 0.0];

/// Controls of one arm, mirrored for the right side.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ArmControls {
    /// Wrist position relative to the neck in torso axes: outwards, down, away from the viewer; metres.
    pub wrist: [f64; 3],
    /// Rotation about the hand's long axis in radians; 0: thumb up, positive: palm up.
    pub roll: f64,
    /// Tangent of the angle of the hand above the line of the forearm.
    pub raise: f64,
    /// Flexion of index to little finger, 0 (straight) to 1 (fist).
    pub curl: f64,
    /// Additional flexion of the index finger; negative: pointing.
    pub index: f64,
    /// Spread of the fingers, radians between neighbours.
    pub spread: f64,
}

/// Number of controls per arm.
pub const N_ARM: usize = 8;

impl From<[f64; N_ARM]> for ArmControls {
    fn from([out, down, away, roll, raise, curl, index, spread]: [f64; N_ARM]) -> Self {
        Self { wrist: [out, down, away], roll, raise, curl, index, spread }
    }
}

/// Controls of the complete figure; angles in radians.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Controls {
    /// Left, right.
    pub arms: [ArmControls; 2],
    /// Rotation about the vertical axis, lean forward, lean to the figure's left.
    pub torso: [f64; 3],
    /// Rotation of the head relative to the torso, in the same order.
    pub head: [f64; 3],
    /// Position of the neck in the world, metres.
    pub neck: Vec3,
}

/// Points of the figure in world coordinates, metres.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnFigure {
    /// Joints in the order of `types::skeleton`.
    pub joints: [Vec3; N_JOINTS],
    /// Nose, left and right eye, left and right ear.
    pub head: [Vec3; 5],
    /// Left, right.
    pub hips: [Vec3; 2],
    /// Centre of the skull.
    pub skull: Vec3,
}

impl DrawnFigure {
    /// Computes the figure from its controls.
    pub fn new(controls: &Controls) -> Self {
        let torso = lean(controls.torso);
        let skull = torso * lean(controls.head);
        let at = |offset: Vec3| add(controls.neck, torso.turn(offset));
        let on_head = |offset: Vec3| add(at(SKULL_BASE), skull.turn(sub(offset, SKULL_BASE)));
        let mut joints = [controls.neck; N_JOINTS];
        joints[NECK] = controls.neck;
        for (arm, (shoulder, hand, side)) in
            controls.arms.iter().zip([(L_SHOULDER, L_HAND, 1.0), (R_SHOULDER, R_HAND, -1.0)])
        {
            let to_world = |[out, down, away]: Vec3| torso.turn([side * out, down, away]);
            let start = at([side * SHOULDER_WIDTH / 2.0, 0.0, 0.0]);
            let (elbow, wrist) =
                solve_arm([UPPER_ARM, FOREARM], start, add(controls.neck, to_world(arm.wrist)), to_world(ELBOW_POLE));
            joints[shoulder] = start;
            joints[shoulder + 1] = elbow;
            joints[shoulder + 2] = wrist;
            joints[hand..hand + N_HAND_JOINTS].copy_from_slice(&fingers(arm, elbow, wrist, side));
        }
        Self { joints, head: HEAD.map(on_head), hips: HIPS.map(at), skull: on_head([0.0, -0.215, 0.005]) }
    }
}

fn lean([turn, forward, sideways]: [f64; 3]) -> Rotation {
    Rotation::about([0.0, 1.0, 0.0], turn)
        * Rotation::about([1.0, 0.0, 0.0], forward)
        * Rotation::about([0.0, 0.0, 1.0], sideways)
}

/// Two-bone inverse kinematics: elbow and wrist of an arm (lengths of upper arm and forearm) from `shoulder` to
/// `target`, with the elbow towards `pole`.
pub fn solve_arm([upper, fore]: [f64; 2], shoulder: Vec3, target: Vec3, pole: Vec3) -> (Vec3, Vec3) {
    let to_target = sub(target, shoulder);
    let target_distance = norm(to_target).max(1e-6);
    let axis = scale(to_target, 1.0 / target_distance);
    let distance = target_distance.clamp(0.3 * (upper + fore), 0.97 * (upper + fore));
    // Distance along the axis to the perpendicular foot of the elbow, and from there to the elbow (law of cosines).
    let along = (distance * distance + upper * upper - fore * fore) / (2.0 * distance);
    let out = (upper * upper - along * along).max(0.0).sqrt();
    let side = direction(sub(pole, scale(axis, dot(pole, axis))));
    let elbow = add(shoulder, add(scale(axis, along), scale(side, out)));
    (elbow, add(shoulder, scale(axis, distance)))
}

/// The 21 joints of a hand: wrist, then thumb to little finger, each from base to tip.
fn fingers(arm: &ArmControls, elbow: Vec3, wrist: Vec3, side: f64) -> [Vec3; N_HAND_JOINTS] {
    let forearm = direction(sub(wrist, elbow));
    let along = direction(add(forearm, [0.0, -arm.raise, 0.0]));
    let up = [0.0, -1.0, 0.6];
    let thumb_up = direction(sub(up, scale(along, dot(up, along))));
    let turn = Rotation::about(along, -side * arm.roll);
    let thumb_side = turn.turn(thumb_up);
    let palm = scale(cross(along, thumb_side), side);
    let from_hand_axes = |[a, t, p]: Vec3| add(scale(along, a), add(scale(thumb_side, t), scale(palm, p)));
    let mut joints = [wrist; N_HAND_JOINTS];
    for (finger, (base, lengths)) in FINGER_BASES.iter().zip(PHALANGES).enumerate() {
        let mut at = add(wrist, from_hand_axes(*base));
        joints[1 + 4 * finger] = at;
        let (bends, across) = if finger == 0 {
            ([0.15, 0.35 * arm.curl, 0.6 * arm.curl], 0.75 - 0.5 * arm.curl + 0.5 * arm.spread)
        } else {
            let curl = (arm.curl + if finger == 1 { arm.index } else { 0.08 * (finger as f64 - 2.0) }).clamp(0.0, 1.1);
            ([0.15 + 1.1 * curl, 0.15 + 1.4 * curl, 0.1 + 0.8 * curl], arm.spread * (2.2 - finger as f64))
        };
        let mut bend = 0.0;
        for (bone, length) in lengths.into_iter().enumerate() {
            bend += bends[bone];
            let flat = [bend.cos() * across.cos(), bend.cos() * across.sin(), bend.sin()];
            at = add(at, scale(from_hand_axes(flat), length));
            joints[2 + 4 * finger + bone] = at;
        }
    }
    joints
}

fn direction(a: Vec3) -> Vec3 {
    scale(a, 1.0 / norm(a).max(1e-9))
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_base::types::skeleton::{L_ELBOW, L_WRIST, R_WRIST, mirror, parent};

    fn posture() -> Controls {
        let arm = ArmControls { wrist: [0.2, 0.2, -0.22], roll: 0.5, raise: 0.5, curl: 0.3, index: -0.2, spread: 0.1 };
        Controls { arms: [arm; 2], ..Controls::default() }
    }

    #[test]
    fn bones_have_their_lengths_and_hands_start_at_the_wrists() {
        let figure = DrawnFigure::new(&posture());
        let length = |a: usize, b: usize| norm(sub(figure.joints[a], figure.joints[b]));
        assert!((length(L_SHOULDER, L_ELBOW) - UPPER_ARM).abs() < 1e-9);
        assert!((length(L_ELBOW, L_WRIST) - FOREARM).abs() < 1e-9);
        assert!((length(L_HAND + 9, L_HAND + 10) - 0.048).abs() < 1e-9);
        assert!((norm(figure.head[0]) - 0.21).abs() < 1e-3);
        assert_eq!(figure.joints[L_WRIST], figure.joints[L_HAND]);
        assert_eq!(figure.joints[R_WRIST], figure.joints[R_HAND]);
        assert!(figure.joints.iter().flatten().all(|v| v.is_finite()));
    }

    #[test]
    fn a_symmetric_posture_gives_a_mirrored_figure() {
        let figure = DrawnFigure::new(&posture());
        for joint in 1..N_JOINTS {
            let ([x, y, z], [mx, my, mz]) = (figure.joints[joint], figure.joints[mirror(joint)]);
            assert!((x + mx).abs() + (y - my).abs() + (z - mz).abs() < 1e-9, "{joint} of {:?}", parent(joint));
        }
    }
}
