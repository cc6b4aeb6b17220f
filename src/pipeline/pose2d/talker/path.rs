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
