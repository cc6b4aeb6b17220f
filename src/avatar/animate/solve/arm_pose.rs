//! Angles of a left arm below its upper arm, and their conversion to and from local rotations of the rig. Half of the
//! hand's rotation about the forearm is given to the forearm.

use crate::animate::rig::hinge::{Bend, Hinge, flexed, side_bend};
use crate::animate::rig::limits::turn;
use crate::animate::rig::rig::{RigArm, finger_hinge};
use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::Vec3;

const X: Vec3 = [1.0, 0.0, 0.0];

/// Angles of an arm, degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ArmPose {
    pub elbow: Bend,
    /// Rotation of the hand about the forearm; 0 with the palm along the elbow axis, positive in supination.
    pub supination: f64,
    /// Wrist; flexion is positive towards the palm, `side` is positive in radial deviation.
    pub wrist: Bend,
    /// Fingers, thumb to little finger, each from knuckle to end joint.
    pub fingers: [[Bend; 3]; 5],
}

/// Hinge of the left elbow, which bends forward.
pub fn elbow() -> Hinge {
    Hinge::new(X, [0.0, -1.0, 0.0])
}

impl ArmPose {
    /// Angles of the arm in a frame's local rotations. The twist of fingers, which joint positions do not determine, is
    /// dropped.
    pub fn from_rotations(arm: &RigArm, local: &[Rotation]) -> Self {
        let of = |joint: usize| on_left(arm, local[joint]);
        let (forearm, hand) = (of(arm.forearm), of(arm.hand));
        let elbow_bend = elbow().bend(forearm.turn(X));
        let untwisted = elbow().rotation(elbow_bend).inverse() * forearm;
        let (_, half) = untwisted.swing_twist(X);
        let (supination, wrist) = Self::hand_angles(untwisted * hand, -2.0 * half.to_degrees(), 0.0);
        let fingers = std::array::from_fn(|finger| {
            let hinge = finger_hinge(finger);
            arm.fingers[finger].map(|joint| hinge.bend(of(joint).turn(hinge.along())))
        });
        Self { elbow: elbow_bend, supination, wrist, fingers }
    }

    /// Writes the angles into a frame's local rotations.
    pub fn write(&self, arm: &RigArm, local: &mut [Rotation]) {
        let mut put = |joint: usize, rotation: Rotation| local[joint] = on_left(arm, rotation);
        let (forearm, hand) = Self::shared(elbow().rotation(self.elbow), self.supination, self.wrist);
        put(arm.forearm, forearm);
        put(arm.hand, hand);
        for (finger, bends) in self.fingers.iter().enumerate() {
            for (&joint, &bend) in arm.fingers[finger].iter().zip(bends) {
                put(joint, finger_hinge(finger).rotation(bend));
            }
        }
    }

    /// Supination and wrist angles of a hand relative to the untwisted forearm. The supination is the equivalent angle
    /// nearest to `previous`, unless its magnitude exceeds 180 + `tolerance` degrees.
    pub fn hand_angles(hand: Rotation, previous: f64, tolerance: f64) -> (f64, Bend) {
        // hand = about x (supination) * side_bend * flexed: the image of the flexion axis -z gives the first two.
        let [x, y, z] = hand.turn([0.0, 0.0, 1.0]);
        let pronation = (-y).atan2(z).to_degrees();
        let along = (about_x(pronation).inverse() * hand).turn(X);
        let side = (-x).clamp(-1.0, 1.0).asin().to_degrees();
        let [x, y, _] = side_bend(side).inverse().turn(along);
        let near = previous + turn(-pronation - previous);
        let supination = if tolerance > 0.0 && near.abs() > 180.0 + tolerance { -pronation } else { near };
        (supination, Bend { flexion: (-y).atan2(x).to_degrees(), side })
    }

    /// Hand rotation of these angles relative to the untwisted forearm.
    pub fn hand(supination: f64, wrist: Bend) -> Rotation {
        about_x(-supination) * side_bend(wrist.side) * flexed(wrist.flexion)
    }

    /// Local rotations of forearm and hand; `bent` is the rotation of the untwisted forearm.
    pub fn shared(bent: Rotation, supination: f64, wrist: Bend) -> (Rotation, Rotation) {
        let half = about_x(-supination / 2.0);
        (bent * half, half * side_bend(wrist.side) * flexed(wrist.flexion))
    }
}

fn about_x(degrees: f64) -> Rotation {
    Rotation::about(X, degrees.to_radians())
}

/// Mirrors a rotation between `arm` and a left arm, in either direction.
fn on_left(arm: &RigArm, rotation: Rotation) -> Rotation {
    if arm.sign < 0.0 { rotation.mirrored() } else { rotation }
}
