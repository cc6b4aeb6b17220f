//! Keypoints detected by another program: all persons in every frame, at its own frame rate and in its own unit.

use super::range::{MAX_EXAMINED_POINTS, UPPER_BODY, are_fractions};
use ndarray::ArrayD;
use orator_base::types::pose2d::{Keypoint, N_BODY, N_HAND, PersonBox};
use orator_base::types::time::FrameRate;

/// Arrays of a file with their names; the array of a `.npy` file has an empty name.
pub type NamedArrays = Vec<(String, ArrayD<f32>)>;

/// One person in a frame, in our point orders; a point with score 0 is missing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FoundPerson {
    /// COCO-17.
    pub body: [Keypoint; N_BODY],
    pub left_hand: [Keypoint; N_HAND],
    pub right_hand: [Keypoint; N_HAND],
}

impl FoundPerson {
    /// All points: body, left hand, right hand.
    pub fn points_mut(&mut self) -> impl Iterator<Item = &mut Keypoint> {
        self.body.iter_mut().chain(&mut self.left_hand).chain(&mut self.right_hand)
    }

    /// Bounding box of the detected body points, with their mean score; `None` if there are none.
    pub fn area(&self) -> Option<PersonBox> {
        let detected: Vec<&Keypoint> = self.body.iter().filter(|point| point.score > 0.0).collect();
        let side = |of: fn(&Keypoint) -> f32| {
            detected.iter().fold([f32::MAX, f32::MIN], |[low, high], point| [low.min(of(point)), high.max(of(point))])
        };
        let ([left, right], [top, bottom]) = (side(|p| p.x), side(|p| p.y));
        let score = detected.iter().map(|point| point.score).sum::<f32>() / detected.len().max(1) as f32;
        let area = PersonBox { x: left, y: top, width: right - left, height: bottom - top, score };
        (!detected.is_empty()).then_some(area)
    }
}

/// Unit and origin of coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CoordinateUnit {
    Pixels,
    /// Fractions 0..1 of the image width and height.
    Fraction,
    /// Pixels relative to the person's neck.
    FromNeck,
}

#[derive(Clone, Debug, PartialEq)]
pub struct FoundKeypoints {
    /// Display name of the format: `OpenPose, 25 points`.
    pub format: String,
    /// Frame rate, if the file states it.
    pub fps: Option<FrameRate>,
    /// Width and height of the image in px, if the file states them.
    pub image_size: Option<[u32; 2]>,
    pub unit: CoordinateUnit,
    /// Point order that was identified by the number of points alone: `BODY_25`; empty if the file states the order.
    pub layout: String,
    pub frames: Vec<Vec<FoundPerson>>,
    /// One sentence for each missing item, naming its substitute.
    pub notes: Vec<String>,
}

impl FoundKeypoints {
    /// Keypoints of a file that states neither frame rate nor image size; the unit is derived from the coordinates.
    pub fn new(format: String, frames: Vec<Vec<FoundPerson>>, notes: Vec<String>) -> Self {
        let unit = if are_fractions(coordinates(&frames)) { CoordinateUnit::Fraction } else { CoordinateUnit::Pixels };
        Self { format, fps: None, image_size: None, unit, layout: String::new(), frames, notes }
    }

    /// Fraction of the examined points that have a negative coordinate, 0..1.
    pub fn negative_fraction(&self) -> f64 {
        let (mut n, mut n_negative) = (0_usize, 0_usize);
        for point in examined_points(&self.frames) {
            n += 1;
            n_negative += usize::from(point.x < 0.0 || point.y < 0.0);
        }
        n_negative as f64 / n.max(1) as f64
    }

    /// Coordinates x, y of the examined points.
    pub fn coordinates(&self) -> impl Iterator<Item = [f32; 2]> {
        coordinates(&self.frames)
    }

    /// Smallest image size in px that contains all body points.
    pub fn extent(&self) -> [u32; 2] {
        let points = || self.frames.iter().flatten().flat_map(|person| &person.body).filter(|point| point.score > 0.0);
        let farthest = |of: fn(&Keypoint) -> f32| points().fold(1.0_f32, |max, point| max.max(of(point)));
        [farthest(|p| p.x), farthest(|p| p.y)].map(|px| px.min(1e6).ceil() as u32)
    }

    /// Converts the coordinates to pixels of an image of that size; a neck at the origin is placed in its upper half.
    pub fn to_pixels(&mut self, image_size: [u32; 2]) {
        let [width, height] = image_size.map(|px| px as f32);
        let (scale, shift) = match self.unit {
            CoordinateUnit::Pixels => return,
            CoordinateUnit::Fraction => ([width, height], [-0.5; 2]),
            CoordinateUnit::FromNeck => ([1.0; 2], [width / 2.0, 0.4 * height]),
        };
        for point in self.frames.iter_mut().flatten().flat_map(FoundPerson::points_mut) {
            if point.score > 0.0 {
                (point.x, point.y) = (scale[0] * point.x + shift[0], scale[1] * point.y + shift[1]);
            }
        }
        self.unit = CoordinateUnit::Pixels;
    }
}

fn coordinates(frames: &[Vec<FoundPerson>]) -> impl Iterator<Item = [f32; 2]> {
    examined_points(frames).map(|point| [point.x, point.y])
}

fn examined_points(frames: &[Vec<FoundPerson>]) -> impl Iterator<Item = &Keypoint> {
    let upper = frames.iter().flatten().flat_map(|person| &person.body[..UPPER_BODY]);
    upper.filter(|point| point.score > 0.0).take(MAX_EXAMINED_POINTS)
}
