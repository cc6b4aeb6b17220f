//! Where in a shot a person is: the boxes of the looks at which the person was found.

use crate::pose2d::decode::boxes;
use orator_base::types::pose2d::PersonBox;

/// Least overlap of a found box with the nearest of the way to be the same person.
pub const SAME_WAY: f32 = 0.3;
/// Frames beyond its ends for which a way still says where the person is.
const REACH: usize = 15;

/// The boxes of a person by frame of the shot, both rising.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TalkerPath(Vec<(usize, PersonBox)>);

impl TalkerPath {
    /// Adds the box at a later frame.
    pub fn push(&mut self, idx: usize, person: PersonBox) {
        self.0.push((idx, person));
    }

    /// The box at the end.
    pub fn last(&self) -> Option<&PersonBox> {
        self.0.last().map(|(_, person)| person)
    }

    /// Which of the people found at a frame goes this way; `None`: nobody does, or the way is elsewhere in the shot.
    pub fn goer(&self, idx: usize, found: impl Iterator<Item = PersonBox>) -> Option<usize> {
        let after = self.0.partition_point(|(at, _)| *at < idx);
        let beside = self.0[after.saturating_sub(1)..].iter().take(2);
        let (at, here) = beside.min_by_key(|(at, _)| at.abs_diff(idx))?;
        let is_inside = after > 0 && after < self.0.len();
        let overlaps = found.map(|one| boxes::overlap(&one, here)).enumerate();
        let (goer, overlap) = overlaps.max_by(|a, b| a.1.total_cmp(&b.1))?;
        (overlap >= SAME_WAY && (is_inside || at.abs_diff(idx) <= REACH)).then_some(goer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f32) -> PersonBox {
        PersonBox { x, y: 0.0, width: 100.0, height: 200.0, score: 0.9 }
    }

    #[test]
    fn a_way_is_gone_by_who_is_nearest_to_it_and_only_while_it_lasts() {
        let mut path = TalkerPath::default();
        assert_eq!((path.goer(0, [at(0.0)].into_iter()), path.last()), (None, None));
        path.push(30, at(0.0));
        path.push(60, at(80.0));
        path.push(65, at(160.0));
        let goer = |idx: usize| path.goer(idx, [at(-300.0), at(150.0), at(10.0)].into_iter());
        assert_eq!([14, 15, 30, 44, 65, 80, 81].map(goer), [None, Some(2), Some(2), Some(2), Some(1), Some(1), None]);
        assert_eq!(path.goer(30, [at(90.0)].into_iter()), None);
        assert_eq!(path.goer(30, std::iter::empty()), None);
        assert_eq!(path.last(), Some(&at(160.0)));
    }
}
