//! The person whom a user chose for a range of frames (`decisions.toml`).

use super::talker::TalkerPath;
use orator_base::types::pose2d::PersonBox;
use std::ops::Range;

/// Frames of a video in which a person is followed, up to the next shot boundary, and the pixel of the full picture at
/// which the person is in the first of them.
pub type ChosenPerson = (Range<usize>, [f32; 2]);

/// Path of the chosen person through the detections of a shot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChosenPath {
    point: [f32; 2],
    path: TalkerPath,
}

impl ChosenPath {
    /// Path of the person at pixel `point` of the next picture.
    pub fn new(point: [f32; 2]) -> Self {
        Self { point, path: TalkerPath::default() }
    }

    /// Whether the person has been detected.
    pub fn is_found(&self) -> bool {
        self.path.last().is_some()
    }

    /// Index of the person among the detections in frame `idx` of the shot: the box that contains the point, if several
    /// the most centrally, and then the box that continues the path.
    pub fn find(&mut self, idx: usize, found: &[PersonBox]) -> Option<usize> {
        // Distance of the point from the middle of a box, in half widths or heights.
        let distance = |one: &PersonBox| {
            let off = |at: f32, start: f32, size: f32| ((at - start) / size.max(1.0) - 0.5).abs() * 2.0;
            off(self.point[0], one.x, one.width).max(off(self.point[1], one.y, one.height))
        };
        let at = if self.is_found() {
            self.path.find(idx, found.iter().copied())
        } else {
            let nearest = found.iter().map(distance).enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
            nearest.filter(|(_, distance)| *distance <= 1.0).map(|(at, _)| at)
        };
        let person = at.and_then(|at| found.get(at));
        person.into_iter().for_each(|person| self.path.push(idx, *person));
        at
    }
}
