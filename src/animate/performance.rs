//! The road from joints to animation: motion is put on a figure whose rotations every file is written from. What was
//! done to it on the way is told.

use super::figure::Figure;
use super::rotations::rotations;
use crate::motion::bvh_write::Clip;
use crate::types::pose3d::Motion;
use crate::types::skeleton::N_JOINTS;
use crate::types::time::FrameRate;
use ndarray::Array3;
use serde::Serialize;

/// How motion becomes an animation; the default is what a user wants.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Options {
    /// Frames a second of what is written; `None`: those of the motion.
    pub fps: Option<FrameRate>,
}

/// Keypoints of the speaker's body in the picture, from which the head is turned: COCO's 17 points, frame by frame
/// those of the motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// [T, 17, 3]: x px, y px, score.
    pub body: Array3<f32>,
}

/// What was done to the motion.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Told {}

/// A motion on its figure.
#[derive(Clone, Debug)]
pub struct Performance {
    pub figure: Figure,
    pub clip: Clip,
    pub told: Told,
}

/// Puts a motion on the figure of its own bone lengths; with a `face` the head turns.
pub fn perform(motion: &Motion, _face: Option<&Face>, options: &Options) -> Performance {
    let figure = Figure::of(motion);
    let local = rotations(motion, &figure);
    let clip = Clip { root: figure.root, skeleton: figure.skeleton.clone(), fps: motion.fps, local };
    let clip = options.fps.map_or_else(|| clip.clone(), |fps| clip.resampled(fps));
    Performance { figure, clip, told: Told::default() }
}

impl Performance {
    /// The joints [T, 49, 3] of the figure (metres, house axes, the neck at the origin) at the clip's rate.
    pub fn motion(&self) -> Motion {
        let mut joints = Array3::zeros((self.clip.n_frames(), N_JOINTS, 3));
        for (frame_idx, mut frame) in joints.outer_iter_mut().enumerate() {
            let places = self.clip.positions(frame_idx);
            let neck = places[self.figure.places[0]];
            for (joint, &place) in self.figure.places.iter().enumerate() {
                for (axis, sign) in [1.0, -1.0, -1.0].into_iter().enumerate() {
                    frame[[joint, axis]] = (sign * (places[place][axis] - neck[axis]) / 100.0) as f32;
                }
            }
        }
        Motion::from_joints(self.clip.fps, joints)
    }
}
