//! Body of a rendered person: proportions, and the conversion of arm postures to joints in the torso's axes (metres, x
//! to the person's left, y down, z away from the viewer; the neck is the origin and the person faces -z).

use ndarray::Array3;
use orator_avatar::animate::rig::rig::Rig;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, cross, scale, sub, unit};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_HAND, L_SHOULDER, N_HAND_JOINTS, N_JOINTS, R_HAND, R_SHOULDER};
use orator_base::types::time::FrameRate;
use orator_test_support::drawn::figure::{FINGER_BASES, PHALANGES, solve_arm};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// First joint of the arm, first joint of the hand and sign of x, for the left and the right side.
pub const SIDES: [(usize, usize, f64); 2] = [(L_SHOULDER, L_HAND, 1.0), (R_SHOULDER, R_HAND, -1.0)];

/// Proportions of a body; lengths in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Build {
    pub shoulder_width: f64,
    pub upper_arm: f64,
    pub forearm: f64,
    /// Size of the hands relative to those of `drawn::figure`, whose middle proximal phalanx measures 48 mm.
    pub hand: f64,
}

impl Build {
    /// A body 1.7 m tall.
    pub const ADULT: Self = Self { shoulder_width: 0.34, upper_arm: 0.29, forearm: 0.25, hand: 1.0 };

    /// A random body 1.5 to 1.95 m tall.
    pub fn sample(rng: &mut ChaCha8Rng) -> Self {
        let height = rng.random_range(0.89..1.14);
        let mut near = |metres: f64, share: f64| metres * height * rng.random_range(1.0 - share..1.0 + share);
        Self {
            shoulder_width: near(0.34, 0.08),
            upper_arm: near(0.29, 0.04),
            forearm: near(0.25, 0.04),
            hand: near(1.0, 0.06),
        }
    }

    /// Size of the body relative to one 1.78 m tall with arms of 0.55 m; the rig's trunk and legs scale with it.
    pub fn unit(&self) -> f64 {
        (self.upper_arm + self.forearm) / 0.55
    }

    /// The rig of the body.
    pub fn rig(&self) -> Rig {
        Rig::from_motion(&self.motion(FrameRate::new(15, 1), &[self.rest_joints()]))
    }

    /// Joints in the rest pose, arms hanging.
    fn rest_joints(&self) -> [[f64; 3]; N_JOINTS] {
        let hanging = ArmPosture {
            wrist: [0.2, 0.4, -0.15],
            elbow: 0.3,
            forward: 0.0,
            roll: 0.5,
            raise: 0.0,
            inwards: 0.0,
            fingers: FingerShape::FLAT,
        };
        joints(self, &[hanging; 2], [hanging.wrist; 2])
    }

    /// Motion of the joints of successive frames.
    pub fn motion(&self, fps: FrameRate, frames: &[[[f64; 3]; N_JOINTS]]) -> Motion {
        let joints = Array3::from_shape_fn((frames.len(), N_JOINTS, 3), |(t, joint, k)| frames[t][joint][k] as f32);
        Motion::from_joints(fps, joints)
    }
}

/// Shape of the fingers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FingerShape {
    /// Flexion of the index to the little finger, 0 straight .. 1 in the fist.
    pub curl: [f64; 4],
    /// Flexion and opposition of the thumb, 0..1.
    pub thumb: [f64; 2],
    /// Angle between neighbouring fingers, radians.
    pub spread: f64,
}

/// Posture of one arm, mirrored for the right side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmPosture {
    /// Wrist relative to the neck in torso axes: outwards, down, away from the viewer; metres of a body of unit 1.
    pub wrist: Vec3,
    /// Outward component of the elbow's direction, relative to its downward component.
    pub elbow: f64,
    /// Forward component of the elbow's direction, relative to its downward component.
    pub forward: f64,
    /// Rotation about the hand's long axis, radians; 0: thumb up (forwards if the hand hangs), positive: palm down.
    pub roll: f64,
    /// Tangent of the angle between hand and forearm, positive: hand raised.
    pub raise: f64,
    /// Tangent of the angle by which the hand points inwards.
    pub inwards: f64,
    pub fingers: FingerShape,
}

impl FingerShape {
    pub const RELAXED: Self = shape([0.22, 0.28, 0.33, 0.38], [0.3, 0.15], 0.05);
    pub const FLAT: Self = shape([0.0, 0.0, 0.03, 0.05], [0.1, 0.1], 0.03);
    pub const OPEN: Self = shape([0.06, 0.08, 0.1, 0.12], [0.0, 0.0], 0.16);
    pub const FIST: Self = shape([0.98, 1.0, 1.0, 1.0], [0.9, 0.8], 0.0);
    pub const POINT: Self = shape([0.02, 0.88, 0.95, 1.0], [0.7, 0.8], 0.03);
    pub const PINCH: Self = shape([0.62, 0.42, 0.36, 0.34], [0.35, 0.9], 0.08);
    pub const ONE: Self = Self::POINT;
    pub const TWO: Self = shape([0.02, 0.03, 0.92, 0.98], [0.8, 0.9], 0.12);
    pub const THREE: Self = shape([0.02, 0.03, 0.06, 0.95], [0.8, 0.9], 0.12);
    pub const INTERLACED: Self = shape([0.5, 0.52, 0.54, 0.56], [0.5, 0.4], 0.07);
    /// Grip of a cup, and of a pen, phone or sheet between thumb and fingers.
    pub const CUP: Self = shape([0.48, 0.5, 0.52, 0.56], [0.25, 0.85], 0.03);
    pub const HELD: Self = shape([0.5, 0.58, 0.68, 0.76], [0.3, 0.85], 0.02);

    fn towards(self, goal: Self, share: f64) -> Self {
        let mix = |a: f64, b: f64| a + share * (b - a);
        Self {
            curl: std::array::from_fn(|k| mix(self.curl[k], goal.curl[k])),
            thumb: std::array::from_fn(|k| mix(self.thumb[k], goal.thumb[k])),
            spread: mix(self.spread, goal.spread),
        }
    }
}

const fn shape(curl: [f64; 4], thumb: [f64; 2], spread: f64) -> FingerShape {
    FingerShape { curl, thumb, spread }
}

impl ArmPosture {
    /// Linear interpolation to another posture; `share` 0..1.
    #[must_use]
    pub fn towards(self, goal: Self, share: f64) -> Self {
        let mix = |a: f64, b: f64| a + share * (b - a);
        Self {
            wrist: std::array::from_fn(|k| mix(self.wrist[k], goal.wrist[k])),
            elbow: mix(self.elbow, goal.elbow),
            forward: mix(self.forward, goal.forward),
            roll: mix(self.roll, goal.roll),
            raise: mix(self.raise, goal.raise),
            inwards: mix(self.inwards, goal.inwards),
            fingers: self.fingers.towards(goal.fingers, share),
        }
    }
}

/// Joints of both arms (`types::skeleton`). The wrist positions in metres are separate from the postures, because
/// contacts move them.
pub fn joints(build: &Build, arms: &[ArmPosture; 2], wrists: [Vec3; 2]) -> [Vec3; N_JOINTS] {
    let mut joints = [[0.0; 3]; N_JOINTS];
    for (side, (shoulder, hand, sign)) in SIDES.into_iter().enumerate() {
        let arm = &arms[side];
        let start = [sign * build.shoulder_width / 2.0, 0.0, 0.0];
        let [out, down, away] = wrists[side];
        let pole = [sign * arm.elbow, 0.95, 0.1 - arm.forward];
        let (elbow, wrist) = solve_arm([build.upper_arm, build.forearm], start, [sign * out, down, away], pole);
        joints[shoulder] = start;
        joints[shoulder + 1] = elbow;
        joints[shoulder + 2] = wrist;
        joints[hand..hand + N_HAND_JOINTS].copy_from_slice(&hand_joints(build, arm, elbow, wrist, sign));
    }
    joints
}

/// Joints of a hand in the posture `arm`, in the same axes as elbow and wrist.
pub fn hand_joints(build: &Build, arm: &ArmPosture, elbow: Vec3, wrist: Vec3, sign: f64) -> [Vec3; N_HAND_JOINTS] {
    let ahead = [0.0, 0.0, -1.0];
    let direction = |a: Vec3| unit(a, 1e-9).unwrap_or(ahead);
    let forearm = direction(sub(wrist, elbow));
    let along = direction(add(forearm, [-sign * arm.inwards, -arm.raise, 0.0]));
    // The thumb of a hand that points forwards is up; the smallest rotation brings it to the hand's direction.
    let thumb_up = Rotation::between(ahead, along).turn([0.0, -1.0, 0.0]);
    let thumb_side = Rotation::about(along, sign * arm.roll).turn(thumb_up);
    let palm = scale(cross(along, thumb_side), sign);
    let place = |[a, t, p]: Vec3| add(scale(along, a), add(scale(thumb_side, t), scale(palm, p)));
    let FingerShape { curl, thumb: [bend, oppose], spread } = arm.fingers;
    let mut joints = [wrist; N_HAND_JOINTS];
    for (finger, (base, lengths)) in FINGER_BASES.iter().zip(PHALANGES).enumerate() {
        let mut at = add(wrist, place(scale(*base, build.hand)));
        joints[1 + 4 * finger] = at;
        let (bends, across) = if finger == 0 {
            ([0.12 + 0.6 * oppose, 0.4 * bend, 0.7 * bend], 0.8 - 0.35 * bend - 0.3 * oppose + 0.5 * spread)
        } else {
            let curl = curl[finger - 1].clamp(0.0, 1.05);
            let fan = spread * (2.2 - finger as f64) * (1.0 - 0.8 * curl);
            ([0.08 + 1.2 * curl, 0.1 + 1.5 * curl, 0.06 + 0.9 * curl], fan)
        };
        let mut flexion = 0.0;
        for (bone, length) in lengths.into_iter().enumerate() {
            flexion += bends[bone];
            let flat = [flexion.cos() * across.cos(), flexion.cos() * across.sin(), flexion.sin()];
            at = add(at, scale(place(flat), length * build.hand));
            joints[2 + 4 * finger + bone] = at;
        }
    }
    joints
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_base::math::vec3::norm;
    use orator_base::types::skeleton::{L_WRIST, mirror};

    #[test]
    fn a_symmetric_posture_is_mirrored_and_a_hand_that_hangs_has_its_thumb_ahead() {
        let build = Build::ADULT;
        let hanging = ArmPosture {
            wrist: [0.22, 0.5, -0.04],
            elbow: 0.3,
            forward: 0.0,
            roll: 0.0,
            raise: 0.0,
            inwards: 0.0,
            fingers: FingerShape::RELAXED,
        };
        let joints = joints(&build, &[hanging; 2], [hanging.wrist; 2]);
        for joint in 1..N_JOINTS {
            let ([x, y, z], [mx, my, mz]) = (joints[joint], joints[mirror(joint)]);
            assert!((x + mx).abs() + (y - my).abs() + (z - mz).abs() < 1e-9, "{joint}");
        }
        let (index, little) = (joints[L_HAND + 5], joints[L_HAND + 17]);
        assert!(index[2] < little[2] - 0.04, "the thumb's side is ahead: {index:?} {little:?}");
        assert!((norm(sub(joints[L_HAND + 9], joints[L_HAND + 10])) - 0.048).abs() < 1e-9);
        assert_eq!(joints[L_WRIST], joints[L_HAND]);
    }
}
