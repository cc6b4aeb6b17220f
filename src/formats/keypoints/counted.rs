//! Persons and arrays whose point order is identified by the number of points: JSON persons, and arrays [T, n, 2..3]
//! in `.npy` and `.npz` files (x, y, score), optionally with `scores` [T, n]. Of the two orders of 25 points, BODY_25
//! and BODY_25B of OpenPose, the one is selected that suits the positions in the complete file.

use super::entry::point;
use super::found::{FoundKeypoints, FoundPerson, NamedArrays};
use super::frames::in_order;
use super::layout::{BODY_25B, PointLayout};
use anyhow::{Error, Result, ensure};
use ndarray::{Ix3, s};
use orator_base::math::order;
use orator_base::types::pose2d::{Keypoint, N_BODY};
use std::collections::{BTreeMap, BTreeSet};

/// Distance of BODY_25's neck from the middle of the shoulders, relative to the size of the upper body, from which on
/// the order is BODY_25B. There, these points are the eyes and the left shoulder, and the distance is about 0.4.
const MAX_NECK_OFFSET: f32 = 0.3;

/// A person of a format without names of the points.
#[derive(Clone, Debug, PartialEq)]
pub struct CountedPerson {
    person: FoundPerson,
    pub n_points: usize,
    /// Of 25 points: the body in the order of BODY_25B, and the relative distance compared with `MAX_NECK_OFFSET`.
    body_25b: Option<(Box<[Keypoint; N_BODY]>, Option<f32>)>,
}

impl CountedPerson {
    /// Identifies the point order by the number of points; the error lists the known numbers.
    pub fn new(points: &[Keypoint]) -> Result<Self, String> {
        let person = PointLayout::for_json(points.len())?.person(points);
        let is_25 = points.len() == BODY_25B.n_points;
        let body_25b = is_25.then(|| (Box::new(BODY_25B.person(points).body), neck_offset(points)));
        Ok(Self { person, n_points: points.len(), body_25b })
    }

    /// The person, to add hands that the format stores separately.
    pub fn person_mut(&mut self) -> &mut FoundPerson {
        &mut self.person
    }

    fn into_person(self, is_25b: bool) -> FoundPerson {
        match self.body_25b {
            Some((body, _)) if is_25b => FoundPerson { body: *body, ..self.person },
            _ => self.person,
        }
    }
}

pub fn of_persons(program: &str, numbered: BTreeMap<u64, Vec<CountedPerson>>) -> Result<FoundKeypoints> {
    let counts: BTreeSet<usize> = numbered.values().flatten().map(|person| person.n_points).collect();
    let offsets = numbered.values().flatten().filter_map(|person| person.body_25b.as_ref()?.1);
    let is_25b = order::median(offsets).is_some_and(|offset| offset > MAX_NECK_OFFSET);
    let name = |&n: &usize| match PointLayout::for_json(n) {
        _ if is_25b && n == BODY_25B.n_points => BODY_25B.name,
        Ok(layout) => layout.name,
        Err(_) => "",
    };
    let layout = counts.iter().map(name).collect::<Vec<_>>().join(" and ");
    let persons = |counted: Vec<CountedPerson>| -> Vec<FoundPerson> {
        counted.into_iter().map(|person| person.into_person(is_25b)).collect()
    };
    let numbered = numbered.into_iter().map(|(number, counted)| (number, persons(counted))).collect();
    let (frames, notes) = in_order(numbered)?;
    let counts = counts.iter().map(|n| n.to_string()).collect::<Vec<_>>().join(" and ");
    let order = if is_25b { " (BODY_25B)" } else { "" };
    let found = FoundKeypoints::new(format!("{program}, {counts} points{order}"), frames, notes);
    Ok(FoundKeypoints { layout, ..found })
}

/// The keypoints of one person; `None` if no array has a known number of points.
///
/// # Errors
///
/// A third number is negative, as in 3D joints.
pub fn read(arrays: &NamedArrays) -> Result<Option<FoundKeypoints>> {
    let fits = |shape: &[usize]| matches!(shape, [_, n, 2 | 3] if PointLayout::for_json(*n).is_ok());
    let Some((_, array)) = arrays.iter().find(|(_, array)| fits(array.shape())) else { return Ok(None) };
    let numbers = array.view().into_dimensionality::<Ix3>()?;
    let (n_frames, n_points, width) = numbers.dim();
    ensure!(
        !numbers.slice(s![.., .., 2..]).iter().any(|number| *number < 0.0),
        "the third number of a point of [{n_frames}, {n_points}, 3] is negative: expected x, y and a score (2D)"
    );
    let is_score = |name: &str| ["score", "conf"].iter().any(|word| name.to_lowercase().contains(word));
    let scores = arrays.iter().find(|(name, array)| array.shape() == [n_frames, n_points] && is_score(name));
    let score = |t: usize, j: usize| match scores {
        _ if width == 3 => numbers[[t, j, 2]],
        Some((_, scores)) => scores[[t, j]],
        None => 1.0,
    };
    let frame = |t: usize| -> Result<(u64, Vec<CountedPerson>)> {
        let at = |j: usize| point(numbers[[t, j, 0]], numbers[[t, j, 1]], score(t, j));
        let points: Vec<Keypoint> = (0..n_points).map(at).collect();
        let person = CountedPerson::new(&points).map_err(Error::msg)?;
        Ok((t as u64, if points.iter().any(|point| point.score > 0.0) { vec![person] } else { Vec::new() }))
    };
    of_persons("keypoint array", (0..n_frames).map(frame).collect::<Result<_>>()?).map(Some)
}

/// Distance of point 1 from the middle of the points 2 and 5 (BODY_25: neck and shoulders), relative to the larger of
/// the shoulder width and the distance from the nose to the neck; `None` if one of the points is missing.
fn neck_offset(points: &[Keypoint]) -> Option<f32> {
    let [nose, neck, right, left] = [0, 1, 2, 5].map(|k| points.get(k).filter(|point| point.score > 0.0));
    let (nose, neck, right, left) = (nose?, neck?, right?, left?);
    let size = (left.x - right.x).hypot(left.y - right.y).max((nose.x - neck.x).hypot(nose.y - neck.y));
    let offset = (neck.x - (left.x + right.x) / 2.0).hypot(neck.y - (left.y + right.y) / 2.0);
    (size > 0.0).then_some(offset / size)
}
