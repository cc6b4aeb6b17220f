//! Joints of a motion in the rig's axes (x, -y, -z of the motion's: y up, facing +z), metres, missing ones `None`.
//! Right arms and hands are handled by mirroring, so that one code for the left side serves both.

use orator_base::math::rotation::Rotation;
use orator_base::math::vec3::{Vec3, across, add, norm, scale, sub, unit};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{self, L_HAND, L_SHOULDER, L_WRIST, N_JOINTS, R_HAND, R_SHOULDER, R_WRIST};

/// Shortest bone with a direction, metres.
const LEAST_METRES: f64 = 1e-5;
/// Distance over which a moved finger tip tells an angle, metres.
const HAND_METRES: f64 = 0.1;

/// Joint positions by frame.
pub struct JointPositions {
    places: Vec<[Option<Vec3>; N_JOINTS]>,
    /// Error of the left and the right hand's directions that the joint limits showed, radians.
    hand_errors: [Vec<f64>; 2],
}

impl JointPositions {
    pub fn from_motion(motion: &Motion) -> Self {
        let place = |frame: &ndarray::ArrayView2<f32>, joint: usize| {
            let place = [0, 1, 2].map(|k| f64::from(frame[[joint, k]]) * if k == 0 { 1.0 } else { -1.0 });
            place.iter().all(|v| v.is_finite()).then_some(place)
        };
        let frame = |frame: ndarray::ArrayView2<f32>| std::array::from_fn(|joint| place(&frame, joint));
        let places: Vec<_> = motion.joints.outer_iter().map(frame).collect();
        let hand_errors = [vec![0.0; places.len()], vec![0.0; places.len()]];
        Self { places, hand_errors }
    }

    /// Joints moved to where `place` (frame, joint) has them, missing ones still missing. How far that is for the tips of
    /// a hand tells how wrong its directions were.
    pub fn moved(&self, place: impl Fn(usize, usize) -> Vec3) -> Self {
        let frame = |(t, frame): (usize, &[Option<Vec3>; N_JOINTS])| {
            std::array::from_fn(|joint| frame[joint].map(|_| place(t, joint)))
        };
        let places: Vec<[Option<Vec3>; N_JOINTS]> = self.places.iter().enumerate().map(frame).collect();
        let error = |t: usize, root: usize, wrist: usize| {
            let from_wrist = |places: &[Option<Vec3>; N_JOINTS], tip: usize| Some(sub(places[tip]?, places[wrist]?));
            let moved = |tip| Some(norm(sub(from_wrist(&places[t], tip)?, from_wrist(&self.places[t], tip)?)));
            let moved: Vec<f64> = (1..=5).filter_map(|finger| moved(root + 4 * finger)).collect();
            moved.iter().sum::<f64>() / moved.len().max(1) as f64 / HAND_METRES
        };
        let hand_errors = [(L_HAND, L_WRIST), (R_HAND, R_WRIST)]
            .map(|(root, wrist)| (0..places.len()).map(|t| error(t, root, wrist)).collect());
        Self { places, hand_errors }
    }

    /// Error of the left hand's directions, radians, by frame; 0 where the limits showed none.
    pub fn hand_error(&self) -> &[f64] {
        &self.hand_errors[0]
    }

    /// Mirror image with left and right exchanged.
    pub fn mirrored(&self) -> Self {
        let image = |frame: &[Option<Vec3>; N_JOINTS]| {
            std::array::from_fn(|joint| frame[skeleton::mirror(joint)].map(|[x, y, z]| [-x, y, z]))
        };
        let [left, right] = &self.hand_errors;
        Self { places: self.places.iter().map(image).collect(), hand_errors: [right.clone(), left.clone()] }
    }

    pub fn n_frames(&self) -> usize {
        self.places.len()
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
        let frame = &self.places[t];
        if joint == L_HAND { frame[L_HAND].or(frame[L_WRIST]) } else { frame[joint] }
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
