//! The person whom a user chose for a range of frames (`decisions.toml`).

use super::talker::TalkerPath;
use orator_base::types::pose2d::PersonBox;
use std::ops::Range;

/// Choice of a person.
#[derive(Clone, Debug, PartialEq)]
pub struct ChosenPerson {
    /// Frames of the video in which the person is followed, up to the next shot boundary.
    pub frames: Range<usize>,
    /// Pixel of the full picture at which the person is in the first of them.
    pub point: [f32; 2],
}

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
        let at = if self.is_found() {
            self.path.find(idx, found.iter().copied())
        } else {
            // Distance from the middle in half widths and heights.
            let distances = found.iter().map(|one| {
                let off = |at: f32, start: f32, size: f32| ((at - start) / size.max(1.0) - 0.5).abs() * 2.0;
                let [x, y] = self.point;
                off(x, one.x, one.width).max(off(y, one.y, one.height))
            });
            let nearest = distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
            nearest.filter(|(_, distance)| *distance <= 1.0).map(|(at, _)| at)
        };
        let person = at.and_then(|at| found.get(at));
        person.into_iter().for_each(|person| self.path.push(idx, *person));
        at
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_person_at_the_point_is_followed_while_it_moves() {
        let at = |x: f32| PersonBox { x, y: 0.0, width: 100.0, height: 200.0, score: 0.9 };
        let mut chosen = ChosenPath::new([330.0, 100.0]);
        assert_eq!((chosen.find(0, &[at(0.0), at(500.0)]), chosen.is_found()), (None, false));
        // Both boxes contain the point, the second more centrally.
        assert_eq!((chosen.find(1, &[at(240.0), at(290.0)]), chosen.is_found()), (Some(1), true));
        assert_eq!(chosen.find(5, &[at(320.0), at(240.0)]), Some(0));
        assert_eq!(chosen.find(10, &[at(240.0), at(350.0)]), Some(1));
        assert_eq!(chosen.find(15, &[at(0.0)]), None);
    }
}
