//! One object of a JSON keypoint file: a person in any format, or a frame of persons. Unknown keys are skipped during
//! parsing, so that only the points are held in memory.

use super::counted::CountedPerson;
use orator_base::text::counted;
use orator_base::types::pose2d::{Keypoint, N_HAND};
use orator_base::types::skeleton::Side;
use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, Error, SeqAccess, Visitor};
use std::fmt;

/// Keys of all formats; each file has some of them.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct JsonEntry {
    /// MMPose: frame number, and the persons of the frame.
    pub frame_id: Option<u64>,
    pub instances: Option<Vec<JsonEntry>>,
    /// AlphaPose, COCO: the image that shows the person.
    pub image_id: Option<ImageName>,
    /// x, y, score of each point; only x, y if `keypoint_scores` is present.
    keypoints: PointNumbers,
    keypoint_scores: PointNumbers,
    /// COCO-WholeBody.
    lefthand_kpts: PointNumbers,
    righthand_kpts: PointNumbers,
    /// OpenPose; the keys had no suffix before version 1.3.
    #[serde(alias = "pose_keypoints")]
    pose_keypoints_2d: Option<PointNumbers>,
    #[serde(alias = "hand_left_keypoints")]
    hand_left_keypoints_2d: PointNumbers,
    #[serde(alias = "hand_right_keypoints")]
    hand_right_keypoints_2d: PointNumbers,
}

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(untagged)]
pub enum ImageName {
    Number(u64),
    Name(String),
}

impl JsonEntry {
    /// Whether the entry has a list of body points, which may be empty.
    pub fn has_body(&self) -> bool {
        self.pose_keypoints_2d.is_some() || !self.keypoints.0.is_empty()
    }

    /// The person; `None` if the list of body points is empty.
    ///
    /// # Errors
    ///
    /// A list whose length matches no known layout.
    pub fn person(&self) -> Result<Option<CountedPerson>, String> {
        let (key, numbers) = match self.pose_keypoints_2d.as_ref().filter(|numbers| !numbers.0.is_empty()) {
            None => ("keypoints", &self.keypoints.0),
            Some(numbers) => ("pose_keypoints_2d", &numbers.0),
        };
        let points = match &self.keypoint_scores.0[..] {
            scores if key == "pose_keypoints_2d" || scores.is_empty() => triples(key, numbers)?,
            scores => scored(numbers, scores)?,
        };
        if points.is_empty() {
            return Ok(None);
        }
        let mut counted_person = CountedPerson::new(&points)?;
        let person = counted_person.person_mut();
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
                format!("`{key}` has {}, expected {N_HAND}", counted(points.len(), "point"))
            })?;
        }
        Ok(Some(counted_person))
    }
}

/// Creates a keypoint. Non-finite coordinates, a score that is not positive, and 0, 0 mean a missing point.
/// Visibility flags of annotations (2: visible, 1: occluded) become scores of 1.
pub fn point(x: f32, y: f32, score: f32) -> Keypoint {
    let is_present = x.is_finite() && y.is_finite() && score > 0.0 && (x != 0.0 || y != 0.0);
    if is_present { Keypoint { x, y, score: score.min(1.0) } } else { Keypoint::default() }
}

fn triples(key: &str, numbers: &[f32]) -> Result<Vec<Keypoint>, String> {
    let (triples, rest) = numbers.as_chunks::<3>();
    if !rest.is_empty() {
        return Err(format!("`{key}` has {} numbers, expected x, y and score for each point", numbers.len()));
    }
    Ok(triples.iter().map(|&[x, y, score]| point(x, y, score)).collect())
}

fn scored(numbers: &[f32], scores: &[f32]) -> Result<Vec<Keypoint>, String> {
    let (pairs, rest) = numbers.as_chunks::<2>();
    if pairs.len() != scores.len() || !rest.is_empty() {
        let (n, n_scores) = (numbers.len(), scores.len());
        return Err(format!("`keypoints` has {n} numbers for {n_scores} scores, expected x and y for each score (2D)"));
    }
    Ok(pairs.iter().zip(scores).map(|(&[x, y], &score)| point(x, y, score)).collect())
}

/// Arbitrarily nested JSON lists of numbers, flattened; `null` is NaN.
#[derive(Clone, Debug, Default, PartialEq)]
struct PointNumbers(Vec<f32>);

impl<'de> Deserialize<'de> for PointNumbers {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut numbers = Vec::new();
        Flat(&mut numbers).deserialize(deserializer)?;
        Ok(Self(numbers))
    }
}

/// Visitor that appends numbers to a list.
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
