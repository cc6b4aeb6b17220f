//! Stance in which the avatar's shape is built: arms down beside the body, elbows and fingers half bent. Poses of
//! speakers are close to it, so skinning deforms the shape little.

use crate::animate::rig::rig::Rig;
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, add, scale, sub, unit};
use orator_base::types::skeleton::{L_HAND, R_HAND};

/// Degrees: upper arm below the horizontal, elbow flexion, and flexion of a finger's joints from knuckle to tip.
const ARM_DEGREES: f64 = 54.0;
const ELBOW_DEGREES: f64 = 35.0;
const FINGER_DEGREES: [f64; 3] = [22.0, 28.0, 18.0];
const THUMB_DEGREES: [f64; 3] = [0.0, 8.0, 10.0];
/// Spread of each finger towards the thumb, degrees (thumb to little finger).
const SPREAD_DEGREES: [f64; 5] = [0.0, 4.0, 1.0, -2.0, -5.0];

/// Index of the rig's hip joint.
pub const HIPS: usize = 0;

/// Joint positions (cm) and world rotations of the rig in the stance.
pub struct Stance {
    pub positions: Vec<Vec3>,
    pub world: Vec<Rotation>,
    /// Positions in the T-pose, cm.
    pub rest: Vec<Vec3>,
    /// Trunk length relative to the reference body.
    pub scale: f64,
}

/// Joints of a finger of the left (0) or right (1) hand, from knuckle to tip.
pub fn finger_joints(rig: &Rig, side: usize, finger: usize) -> [usize; 4] {
    let base = [L_HAND, R_HAND][side] + 1 + 4 * finger;
    std::array::from_fn(|k| rig.positions[base + k])
}

impl Stance {
    pub fn new(rig: &Rig) -> Self {
        let identity = vec![Rotation::IDENTITY; rig.skeleton.joints.len()];
        let mut local = identity.clone();
        for (side, arm) in rig.arms.iter().enumerate() {
            let curl = [0.0, 0.0, -arm.sign];
            local[arm.upper] = Rotation::about(curl, ARM_DEGREES.to_radians());
            local[arm.forearm] = Rotation::about([0.0, -arm.sign, 0.0], ELBOW_DEGREES.to_radians());
            for (finger, spread) in SPREAD_DEGREES.into_iter().enumerate() {
                let degrees = if finger == 0 { THUMB_DEGREES } else { FINGER_DEGREES };
                let joints = finger_joints(rig, side, finger);
                for (&joint, degrees) in joints.iter().zip(degrees) {
                    local[joint] = Rotation::about(curl, degrees.to_radians());
                }
                let spread = Rotation::about([0.0, -arm.sign, 0.0], f64::to_radians(spread));
                local[joints[0]] = spread * local[joints[0]];
            }
        }
        let rest = rig.skeleton.positions(rig.root, &identity);
        Self {
            positions: rig.skeleton.positions(rig.root, &local),
            world: rig.skeleton.world(&local),
            scale: (rest[rig.neck][1] - rest[HIPS][1]) / 50.0,
            rest,
        }
    }

    /// Point at offset `cm` from a joint, in its axes, scaled from the reference body.
    pub fn at(&self, joint: usize, cm: Vec3) -> Vec3 {
        add(self.positions[joint], self.world[joint].turn(scale(cm, self.scale)))
    }

    /// Unit vector from one joint to another.
    pub fn direction(&self, from: usize, to: usize) -> Vec3 {
        unit(sub(self.positions[to], self.positions[from]), 1e-6).unwrap_or([0.0, 1.0, 0.0])
    }
}
