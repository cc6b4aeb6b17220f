//! Joints of a motion in the rig's axes (x, -y, -z of the motion's: y up, facing +z), metres, `None` if missing. Right
//! arms and hands are mirrored, so that the code for the left side handles both.

use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, across, add, norm, scale, sub, unit};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{self, L_HAND, L_SHOULDER, L_WRIST, N_JOINTS, R_HAND, R_SHOULDER, R_WRIST};

/// Minimum length of a bone whose direction is defined, metres.
const MIN_METRES: f64 = 1e-5;
/// Lever over which the displacement of a finger tip is converted to an angle, metres.
const LEVER_METRES: f64 = 0.1;

/// Points of a hand, its wrist first.
pub type HandPositions = [Option<Vec3>; skeleton::N_HAND_JOINTS];

pub struct JointPositions {
    positions: Vec<[Option<Vec3>; N_JOINTS]>,
    /// Errors of the left and right hand's directions, estimated by the joint limits, radians, by frame.
    hand_errors: [Vec<f64>; 2],
}

impl JointPositions {
    pub fn from_motion(motion: &Motion) -> Self {
        let position = |frame: &ndarray::ArrayView2<f32>, joint: usize| {
            let position = [0, 1, 2].map(|k| f64::from(frame[[joint, k]]) * if k == 0 { 1.0 } else { -1.0 });
            position.iter().all(|v| v.is_finite()).then_some(position)
        };
        let frame = |frame: ndarray::ArrayView2<f32>| std::array::from_fn(|joint| position(&frame, joint));
        let positions: Vec<_> = motion.joints.outer_iter().map(frame).collect();
        let hand_errors = [vec![0.0; positions.len()], vec![0.0; positions.len()]];
        Self { positions, hand_errors }
    }

    /// Replaces the joints by `position` (frame, joint); missing ones stay missing. The displacement of a hand's finger
    /// tips is an estimate of the error of its directions.
    pub fn with_positions(&self, position: impl Fn(usize, usize) -> Vec3) -> Self {
        let frame = |(t, frame): (usize, &[Option<Vec3>; N_JOINTS])| {
            std::array::from_fn(|joint| frame[joint].map(|_| position(t, joint)))
        };
        let positions: Vec<[Option<Vec3>; N_JOINTS]> = self.positions.iter().enumerate().map(frame).collect();
        let error = |t: usize, root: usize, wrist: usize| {
            let from_wrist =
                |positions: &[Option<Vec3>; N_JOINTS], tip: usize| Some(sub(positions[tip]?, positions[wrist]?));
            let moved = |tip| Some(norm(sub(from_wrist(&positions[t], tip)?, from_wrist(&self.positions[t], tip)?)));
            let moved: Vec<f64> = (1..=5).filter_map(|finger| moved(root + 4 * finger)).collect();
            moved.iter().sum::<f64>() / moved.len().max(1) as f64 / LEVER_METRES
        };
        let hand_errors = [(L_HAND, L_WRIST), (R_HAND, R_WRIST)]
            .map(|(root, wrist)| (0..positions.len()).map(|t| error(t, root, wrist)).collect());
        Self { positions, hand_errors }
    }

    pub fn left_hand(&self, t: usize) -> HandPositions {
        std::array::from_fn(|point| self.position(t, L_HAND + point))
    }

    /// Replaces the given points of the left hand by frame.
    pub fn with_left_hand(&self, hands: &[Option<HandPositions>]) -> Self {
        let mut positions = self.positions.clone();
        for (frame, hand) in positions.iter_mut().zip(hands) {
            let Some(hand) = hand else { continue };
            // The wrist moves with the hand, also where the two do not coincide.
            if let (Some(root), Some(moved), Some(wrist)) = (frame[L_HAND], hand[0], &mut frame[L_WRIST]) {
                *wrist = add(*wrist, sub(moved, root));
            }
            frame[L_HAND..R_HAND].iter_mut().zip(hand).for_each(|(joint, point)| *joint = point.or(*joint));
        }
        Self { positions, hand_errors: self.hand_errors.clone() }
    }

    /// Error of the left hand's directions, radians, by frame; 0 if the limits changed nothing.
    pub fn hand_error(&self) -> &[f64] {
        &self.hand_errors[0]
    }

    /// Mirror image with left and right exchanged.
    pub fn mirrored(&self) -> Self {
        let image = |frame: &[Option<Vec3>; N_JOINTS]| {
            std::array::from_fn(|joint| frame[skeleton::mirror(joint)].map(|[x, y, z]| [-x, y, z]))
        };
        let [left, right] = &self.hand_errors;
        Self { positions: self.positions.iter().map(image).collect(), hand_errors: [right.clone(), left.clone()] }
    }

    pub fn n_frames(&self) -> usize {
        self.positions.len()
    }

    /// Vector from one joint to another, metres; `None` if a joint is missing.
    pub fn offset(&self, t: usize, from: usize, to: usize) -> Option<Vec3> {
        Some(sub(self.position(t, to)?, self.position(t, from)?))
    }

    /// Unit vector from one joint to another; `None` if a joint is missing or both coincide.
    pub fn direction(&self, t: usize, from: usize, to: usize) -> Option<Vec3> {
        unit(self.offset(t, from, to)?, MIN_METRES)
    }

    /// Horizontal part of the direction from the right to the left shoulder, a unit vector.
    pub fn shoulder_line(&self, t: usize) -> Option<Vec3> {
        let [x, _, z] = sub(self.position(t, L_SHOULDER)?, self.position(t, R_SHOULDER)?);
        unit([x, 0.0, z], MIN_METRES)
    }

    /// World rotation of the left hand, computed from the direction to the mean of its knuckles and from the direction
    /// from the index finger's base to the little finger's. The rest pose points along x, palm down, thumb at +z.
    pub fn hand_frame(&self, t: usize) -> Option<Rotation> {
        let wrist = self.position(t, L_HAND)?;
        knuckle_frame([1, 2, 3, 4].map(|finger| Some(sub(self.position(t, L_HAND + 1 + 4 * finger)?, wrist))))
    }

    /// Bases of the left hand's fingers, thumb first, in the hand's frame, metres.
    pub fn palm(&self, t: usize) -> Option<[Option<Vec3>; 5]> {
        let (wrist, into_hand) = (self.position(t, L_HAND)?, self.hand_frame(t)?.inverse());
        let base = |finger| Some(into_hand.turn(sub(self.position(t, L_HAND + 1 + 4 * finger)?, wrist)));
        Some(std::array::from_fn(base))
    }

    fn position(&self, t: usize, joint: usize) -> Option<Vec3> {
        // The root of a hand is its wrist.
        let frame = &self.positions[t];
        if joint == L_HAND { frame[L_HAND].or(frame[L_WRIST]) } else { frame[joint] }
    }
}

/// Frame of a palm, given its finger bases relative to the wrist, thumb first.
pub fn palm_frame(&[_, index, middle, ring, little]: &[Vec3; 5]) -> Option<Rotation> {
    knuckle_frame([index, middle, ring, little].map(Some))
}

fn knuckle_frame(knuckles: [Option<Vec3>; 4]) -> Option<Rotation> {
    let [index, .., little] = knuckles;
    let (sum, n) =
        knuckles.into_iter().flatten().fold(([0.0; 3], 0.0), |(sum, n), position| (add(sum, position), n + 1.0));
    hand_rotation(unit(scale(sum, 1.0 / n), MIN_METRES)?, sub(little?, index?))
}

/// Rotation of a left hand that points along the unit vector `along`, with its little finger towards `side`.
fn hand_rotation(along: Vec3, side: Vec3) -> Option<Rotation> {
    let side = unit(across(side, along), MIN_METRES)?;
    Some(Rotation::between_frames(([1.0, 0.0, 0.0], [0.0, 0.0, -1.0]), (along, side)))
}
