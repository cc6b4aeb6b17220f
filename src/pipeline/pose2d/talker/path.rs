//! Path of a person through a shot: the boxes of the frames in which the detector found the person.

use crate::pose2d::decode::boxes;
use orator_base::types::pose2d::PersonBox;

/// Least overlap of a detection with the nearest box of the path to be the same person.
pub const MIN_OVERLAP: f32 = 0.3;
/// Number of frames beyond its ends for which a path is extrapolated.
const MAX_EXTRAPOLATION: usize = 15;

/// Boxes of a person, ordered by frame of the shot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TalkerPath(Vec<(usize, PersonBox)>);

impl TalkerPath {
    /// Adds the box of a later frame.
    pub fn push(&mut self, idx: usize, person: PersonBox) {
        self.0.push((idx, person));
    }

    /// The last box.
    pub fn last(&self) -> Option<&PersonBox> {
        self.0.last().map(|(_, person)| person)
    }

    /// Index of the detection at frame `idx` that matches the path; `None` if none does or the path lacks the frame.
    pub fn find(&self, idx: usize, found: impl Iterator<Item = PersonBox>) -> Option<usize> {
        let after = self.0.partition_point(|(at, _)| *at < idx);
        let neighbours = self.0[after.saturating_sub(1)..].iter().take(2);
        let (at, nearest) = neighbours.min_by_key(|(at, _)| at.abs_diff(idx))?;
        let is_inside = after > 0 && after < self.0.len();
        let overlaps = found.map(|one| boxes::overlap(&one, nearest)).enumerate();
        let (best, overlap) = overlaps.max_by(|a, b| a.1.total_cmp(&b.1))?;
        (overlap >= MIN_OVERLAP && (is_inside || at.abs_diff(idx) <= MAX_EXTRAPOLATION)).then_some(best)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f32) -> PersonBox {
        PersonBox { x, y: 0.0, width: 100.0, height: 200.0, score: 0.9 }
    }

    #[test]
    fn a_path_matches_the_nearest_person_within_its_frames() {
        let mut path = TalkerPath::default();
        assert_eq!((path.find(0, [at(0.0)].into_iter()), path.last()), (None, None));
        path.push(30, at(0.0));
        path.push(60, at(80.0));
        path.push(65, at(160.0));
        let find = |idx: usize| path.find(idx, [at(-300.0), at(150.0), at(10.0)].into_iter());
        assert_eq!([14, 15, 30, 44, 65, 80, 81].map(find), [None, Some(2), Some(2), Some(2), Some(1), Some(1), None]);
        assert_eq!(path.find(30, [at(90.0)].into_iter()), None);
        assert_eq!(path.find(30, std::iter::empty()), None);
        assert_eq!(path.last(), Some(&at(160.0)));
    }
}
