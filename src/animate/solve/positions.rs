//! Joints of a motion in the rig's axes (x, -y, -z of the motion's: y up, facing +z), metres, missing ones `None`.
//! Right arms and hands are handled by mirroring, so that one code for the left side serves both.

use crate::math::rotation::Rotation;
use crate::math::vec3::{Vec3, across, add, scale, sub, unit};
use crate::types::pose3d::Motion;
use crate::types::skeleton;
use crate::types::skeleton::{L_HAND, L_SHOULDER, L_WRIST, N_JOINTS, R_SHOULDER};

/// Shortest bone with a direction, metres.
const LEAST_METRES: f64 = 1e-5;

/// Joint positions by frame.
pub struct JointPositions(pub(crate) Vec<[Option<Vec3>; N_JOINTS]>);

impl JointPositions {
    pub fn from_motion(motion: &Motion) -> Self {
        let place = |frame: &ndarray::ArrayView2<f32>, joint: usize| {
            let place = [0, 1, 2].map(|k| f64::from(frame[[joint, k]]) * if k == 0 { 1.0 } else { -1.0 });
            place.iter().all(|v| v.is_finite()).then_some(place)
        };
        Self(motion.joints.outer_iter().map(|frame| std::array::from_fn(|joint| place(&frame, joint))).collect())
    }

    /// Mirror image with left and right exchanged.
    pub fn mirrored(&self) -> Self {
        let image = |frame: &[Option<Vec3>; N_JOINTS]| {
            std::array::from_fn(|joint| frame[skeleton::mirror(joint)].map(|[x, y, z]| [-x, y, z]))
        };
        Self(self.0.iter().map(image).collect())
    }

    pub fn n_frames(&self) -> usize {
        self.0.len()
    }

    /// Unit vector from one joint to another.
    pub fn direction(&self, t: usize, from: usize, to: usize) -> Option<Vec3> {
        unit(sub(self.place(t, to)?, self.place(t, from)?), LEAST_METRES)
    }

    /// Horizontal part of the direction from the right to the left shoulder, a unit vector.
    pub fn shoulder_line(&self, t: usize) -> Option<Vec3> {
        let [x, _, z] = sub(self.place(t, L_SHOULDER)?, self.place(t, R_SHOULDER)?);
        unit([x, 0.0, z], LEAST_METRES)
    }

    /// World rotation of the left hand: along from the wrist to the middle of its knuckles, across from the index
    /// finger's base to the little finger's. At rest along x, palm down, thumb at +z.
    pub fn hand_frame(&self, t: usize) -> Option<Rotation> {
        let wrist = self.place(t, L_HAND)?;
        knuckle_frame([1, 2, 3, 4].map(|finger| Some(sub(self.place(t, L_HAND + 1 + 4 * finger)?, wrist))))
    }

    /// Bases of the left hand's fingers, thumb first, in the hand's frame.
    pub fn palm(&self, t: usize) -> Option<[Option<Vec3>; 5]> {
        let (wrist, into_hand) = (self.place(t, L_HAND)?, self.hand_frame(t)?.inverse());
        let base = |finger| Some(into_hand.turn(sub(self.place(t, L_HAND + 1 + 4 * finger)?, wrist)));
        Some(std::array::from_fn(base))
    }

    fn place(&self, t: usize, joint: usize) -> Option<Vec3> {
        // A hand's root is its wrist.
        if joint == L_HAND { self.0[t][L_HAND].or(self.0[t][L_WRIST]) } else { self.0[t][joint] }
    }
}

/// Frame of a palm whose finger bases, thumb first, are given from the wrist.
pub fn palm_frame(&[_, index, middle, ring, little]: &[Vec3; 5]) -> Option<Rotation> {
    knuckle_frame([index, middle, ring, little].map(Some))
}

fn knuckle_frame(knuckles: [Option<Vec3>; 4]) -> Option<Rotation> {
    let [index, .., little] = knuckles;
    let (sum, n) = knuckles.into_iter().flatten().fold(([0.0; 3], 0.0), |(sum, n), place| (add(sum, place), n + 1.0));
    hand_rotation(unit(scale(sum, 1.0 / n), LEAST_METRES)?, sub(little?, index?))
}

/// Rotation of a left hand along the unit vector `along`, its little finger towards `side`.
fn hand_rotation(along: Vec3, side: Vec3) -> Option<Rotation> {
    let side = unit(across(side, along), LEAST_METRES)?;
    Some(Rotation::between_frames(([1.0, 0.0, 0.0], [0.0, 0.0, -1.0]), (along, side)))
}
