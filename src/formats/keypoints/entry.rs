//! One object of a JSON file of keypoints: a person of any format, or a frame of them. What is not known is passed over
//! while reading, so that memory holds points alone.

use super::found::FoundPerson;
use super::layout::PointLayout;
use orator_base::types::pose2d::{Keypoint, N_HAND};
use orator_base::types::skeleton::Side;
use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, Error, SeqAccess, Visitor};
use std::fmt;

/// Keys of all formats together; each file has some of them.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct JsonEntry {
    /// MMPose: number of the frame, and its people.
    pub frame_id: Option<u64>,
    pub instances: Option<Vec<JsonEntry>>,
    /// AlphaPose, COCO: the picture that shows the person.
    pub image_id: Option<ImageName>,
    /// x, y, score of each point; x, y of each point beside `keypoint_scores`.
    keypoints: PointNumbers,
    keypoint_scores: PointNumbers,
    /// COCO-WholeBody.
    lefthand_kpts: PointNumbers,
    righthand_kpts: PointNumbers,
    /// OpenPose.
    pose_keypoints_2d: PointNumbers,
    hand_left_keypoints_2d: PointNumbers,
    hand_right_keypoints_2d: PointNumbers,
}

/// Name or number of a picture.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(untagged)]
pub enum ImageName {
    Number(u64),
    Name(String),
}

impl JsonEntry {
    /// The person, and the number of points of the body's list; `None` where the list is empty. Errors: a list of
    /// another length than a known order has.
    pub fn person(&self) -> Result<Option<(FoundPerson, usize)>, String> {
        let (key, numbers) = match self.pose_keypoints_2d.0.is_empty() {
            true => ("keypoints", &self.keypoints.0),
            false => ("pose_keypoints_2d", &self.pose_keypoints_2d.0),
        };
        let points = match &self.keypoint_scores.0[..] {
            scores if key == "pose_keypoints_2d" || scores.is_empty() => triples(key, numbers)?,
            scores => scored(numbers, scores)?,
        };
        if points.is_empty() {
            return Ok(None);
        }
        let mut person = PointLayout::of_json(points.len())?.person(&points);
        let hands = [
            ("hand_left_keypoints_2d", &self.hand_left_keypoints_2d, Side::Left),
            ("hand_right_keypoints_2d", &self.hand_right_keypoints_2d, Side::Right),
            ("lefthand_kpts", &self.lefthand_kpts, Side::Left),
            ("righthand_kpts", &self.righthand_kpts, Side::Right),
        ];
        for (key, numbers, side) in hands.into_iter().filter(|(_, numbers, _)| !numbers.0.is_empty()) {
            let points = triples(key, &numbers.0)?;
            let hand = if side == Side::Left { &mut person.left_hand } else { &mut person.right_hand };
            *hand = points.try_into().map_err(|points: Vec<Keypoint>| {
                format!("`{key}` holds {} points, expected {N_HAND} of a hand", points.len())
            })?;
        }
        Ok(Some((person, points.len())))
    }
}

/// A point; one that is not a number, or lies at 0, 0, is missing. Visibilities of annotations (2: visible, 1: hidden)
/// are scores of 1.
pub fn point(x: f32, y: f32, score: f32) -> Keypoint {
    let is_there = x.is_finite() && y.is_finite() && score > 0.0 && (x != 0.0 || y != 0.0);
    if is_there { Keypoint { x, y, score: score.min(1.0) } } else { Keypoint::default() }
}

fn triples(key: &str, numbers: &[f32]) -> Result<Vec<Keypoint>, String> {
    let (triples, rest) = numbers.as_chunks::<3>();
    if !rest.is_empty() {
        return Err(format!("`{key}` holds {} numbers, expected x, y and score of each point", numbers.len()));
    }
    Ok(triples.iter().map(|&[x, y, score]| point(x, y, score)).collect())
}

fn scored(numbers: &[f32], scores: &[f32]) -> Result<Vec<Keypoint>, String> {
    let (pairs, rest) = numbers.as_chunks::<2>();
    if pairs.len() != scores.len() || !rest.is_empty() {
        let (n, n_scores) = (numbers.len(), scores.len());
        return Err(format!("`keypoints` holds {n} numbers for {n_scores} scores, expected x and y for each (2D)"));
    }
    Ok(pairs.iter().zip(scores).map(|(&[x, y], &score)| point(x, y, score)).collect())
}

/// Lists of numbers in JSON, however deep they are nested, as one flat list; `null` is NaN.
#[derive(Clone, Debug, Default, PartialEq)]
struct PointNumbers(Vec<f32>);

impl<'de> Deserialize<'de> for PointNumbers {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut numbers = Vec::new();
        Flat(&mut numbers).deserialize(deserializer)?;
        Ok(Self(numbers))
    }
}

/// The list that numbers are put on.
struct Flat<'a>(&'a mut Vec<f32>);

impl<'de> DeserializeSeed<'de> for Flat<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Flat<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "numbers or lists of numbers")
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<(), E> {
        self.0.push(number as f32);
        Ok(())
    }

    fn visit_u64<E: Error>(self, number: u64) -> Result<(), E> {
        self.visit_f64(number as f64)
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<(), E> {
        self.visit_f64(number as f64)
    }

    fn visit_unit<E: Error>(self) -> Result<(), E> {
        self.visit_f64(f64::NAN)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<(), A::Error> {
        while list.next_element_seed(Flat(self.0))?.is_some() {}
        Ok(())
    }
}
