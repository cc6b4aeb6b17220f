//! 2D keypoints: one frame as the detectors give it, and a whole video as it is stored.

use super::time::FrameRate;
use ndarray::Array3;
use serde::{Deserialize, Serialize};

/// Points of a body, COCO-17: nose, left/right eye, ear, shoulder, elbow, wrist, hip, knee, ankle (odd = left).
pub const N_BODY: usize = 17;
/// Points of a hand: wrist, then thumb, index, middle, ring, little, each base to tip.
pub const N_HAND: usize = 21;

/// A keypoint counts as seen from this score on.
pub const SEEN_SCORE: f32 = 0.3;
/// A hand's keypoint counts as seen by the hand lifter from this score on.
pub const HAND_SEEN_SCORE: f32 = 0.2;

/// COCO-17 indices.
pub mod coco {
    pub const NOSE: usize = 0;
    pub const L_EYE: usize = 1;
    pub const R_EYE: usize = 2;
    pub const L_EAR: usize = 3;
    pub const R_EAR: usize = 4;
    pub const L_SHOULDER: usize = 5;
    pub const R_SHOULDER: usize = 6;
    pub const L_ELBOW: usize = 7;
    pub const R_ELBOW: usize = 8;
    pub const L_WRIST: usize = 9;
    pub const R_WRIST: usize = 10;
    pub const L_HIP: usize = 11;
    pub const R_HIP: usize = 12;
}

/// A point of the picture in pixels (x right, y down, the centre of the top left pixel is 0, 0) and how sure the
/// detector is, 0..1; score 0 means missing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Keypoint {
    pub x: f32,
    pub y: f32,
    pub score: f32,
}

/// A box of the picture in pixels, top left corner and size, with the detector's score.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PersonBox {
    pub x: f32,
    pub y: f32,
    pub width: f32,
    pub height: f32,
    pub score: f32,
}

/// Person and keypoints of one frame. A hand or body not found is all zeros.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose2d {
    /// The followed person.
    pub person: PersonBox,
    /// People in view.
    pub n_people: u8,
    /// Number of the person that is tracked; it changes with the person.
    pub identity: i64,
    /// COCO-17.
    pub body: [Keypoint; N_BODY],
    /// The speaker's left hand.
    pub left_hand: [Keypoint; N_HAND],
    /// The speaker's right hand.
    pub right_hand: [Keypoint; N_HAND],
    /// Whether the other hand was found where the left and the right hand were looked for, which then count as missing.
    pub other_hand: [bool; 2],
    /// The speaker's face, where it is seen closely.
    pub face: Option<FaceSeen>,
}

/// What is seen of a face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FaceSeen {
    /// How sure it is that there is a face, 0..1.
    pub score: f32,
    /// Distance of the lips in distances between the outer corners of the eyes.
    pub opening: f32,
}

impl Pose2d {
    /// What is seen in a part of a picture, as px of the whole: the part's corner is at `x`, `y`.
    #[must_use]
    pub fn moved(mut self, [x, y]: [usize; 2]) -> Self {
        let [x, y] = [x as f32, y as f32];
        let points = self.body.iter_mut().chain(&mut self.left_hand).chain(&mut self.right_hand);
        for point in points.filter(|point| point.score > 0.0) {
            (point.x, point.y) = (point.x + x, point.y + y);
        }
        if self.person.score > 0.0 {
            (self.person.x, self.person.y) = (self.person.x + x, self.person.y + y);
        }
        self
    }
}

/// The keypoints of a whole video at the dataset rate; last axis x px, y px, score; score 0 = missing.
#[derive(Clone, Debug, PartialEq)]
pub struct Keypoints {
    /// The dataset rate.
    pub fps: FrameRate,
    /// Width and height in px of the upright picture.
    pub image_size: [u32; 2],
    /// [T, 17, 3]
    pub body: Array3<f32>,
    /// [T, 21, 3]
    pub left_hand: Array3<f32>,
    /// [T, 21, 3]
    pub right_hand: Array3<f32>,
}

impl Keypoints {
    /// Number of frames T.
    pub fn n_frames(&self) -> usize {
        self.body.shape()[0]
    }
}
