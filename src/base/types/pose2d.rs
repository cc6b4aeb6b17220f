//! 2D keypoints: one frame as detected, and a complete video as stored.

use super::time::FrameRate;
use ndarray::Array3;
use serde::{Deserialize, Serialize};

/// Number of body keypoints, COCO-17: nose, left/right eye, ear, shoulder, elbow, wrist, hip, knee, ankle (odd = left).
pub const N_BODY: usize = 17;
/// Number of hand keypoints: wrist, then thumb, index, middle, ring, little finger, each from base to tip.
pub const N_HAND: usize = 21;

pub const VISIBLE_SCORE: f32 = 0.3;
/// Minimum score of a visible hand keypoint for the hand lifter.
pub const HAND_VISIBLE_SCORE: f32 = 0.2;

/// Keypoint indices of COCO-17.
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

/// Point in a picture, in pixels (x right, y down, the centre of the top left pixel is 0, 0), with the detector's
/// confidence, 0..1; score 0 means missing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Keypoint {
    pub x: f32,
    pub y: f32,
    pub score: f32,
}

/// Bounding box in pixels: top left corner and size, with the detector's score.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PersonBox {
    pub x: f32,
    pub y: f32,
    pub width: f32,
    pub height: f32,
    pub score: f32,
}

/// Tracked person and keypoints of one frame. Keypoints of a missing hand or body are all zeros.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose2d {
    pub person: PersonBox,
    pub n_persons: u8,
    /// Track id of the tracked person.
    pub identity: i64,
    /// Body keypoints, COCO-17.
    pub body: [Keypoint; N_BODY],
    pub left_hand: [Keypoint; N_HAND],
    pub right_hand: [Keypoint; N_HAND],
    /// Depth of the points of the [left, right] hand relative to the wrist, in px, away from the camera; `None` for a
    /// missing hand and for hand models without depth.
    pub hand_depth: [Option<[f32; N_HAND]>; 2],
    /// Whether the opposite hand was found in the search regions of the [left, right] hand, which is then missing.
    pub other_hand: [bool; 2],
    /// The speaker's face, if it is large enough in the picture.
    pub face: Option<FaceMeasurement>,
}

/// Mouth of a detected face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FaceMeasurement {
    /// Confidence that the region contains a face, 0..1.
    pub score: f32,
    /// Distance between the lips in distances between the outer corners of the eyes.
    pub opening: f32,
}

impl Pose2d {
    /// Converts detections in a crop with the top left corner (`x`, `y`) to px of the full picture.
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

/// Keypoints of a complete video at the dataset rate; last axis: x px, y px, score; score 0 means missing.
#[derive(Clone, Debug, PartialEq)]
pub struct Keypoints {
    pub fps: FrameRate,
    /// Width and height of the upright picture in px.
    pub image_size: [u32; 2],
    /// [T, 17, 3]
    pub body: Array3<f32>,
    /// [T, 21, 3]
    pub left_hand: Array3<f32>,
    /// [T, 21, 3]
    pub right_hand: Array3<f32>,
    /// Depth of the points of the left and right hand relative to the wrist, in px, away from the camera, [T, 2, 21];
    /// NaN: unknown. `None`: the hand model gives no depth.
    pub hand_depth: Option<Array3<f32>>,
}

impl Keypoints {
    pub fn n_frames(&self) -> usize {
        self.body.shape()[0]
    }
}
