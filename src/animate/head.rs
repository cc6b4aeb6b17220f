//! The head, turned as the face in the picture is.

use super::arm::Means;
use super::figure::Figure;
use super::track::Track;
use ndarray::Array3;

/// Keypoints of the speaker's body in the picture, from which the head is turned: COCO's 17 points, frame by frame
/// those of the motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// [T, 17, 3]: x px, y px, score.
    pub body: Array3<f32>,
}

/// Turns neck and head; gives the number of frames in which the face was seen.
pub fn turn(_face: &Face, _figure: &Figure, _means: &Means, _local: &mut [Track]) -> usize {
    0
}
