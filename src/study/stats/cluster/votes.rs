//! Scores by participant and clip, and how they are grouped by them.

use super::super::error::{StatisticsError, at_least, finite};
use std::collections::BTreeMap;

/// Score of one participant in one trial about one clip: 1 and 0 for right and wrong, a rating, a signed preference.
/// Numbers of participants and clips may have gaps; the cells of a study share them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClipVote {
    pub participant: usize,
    pub clip: usize,
    pub score: f64,
}

/// What votes may share.
pub(in super::super) const PARTICIPANT: usize = 0;
pub(in super::super) const CLIP: usize = 1;
pub(super) const PAIR: usize = 2;

/// Groups of the votes of all cells of a study, one cell after the other: by participant, by clip, by both. Groups are
/// numbered in ascending order, without gaps.
pub(in super::super) struct VoteGroups {
    /// Group of each vote.
    pub of: [Vec<usize>; 3],
    pub n: [usize; 3],
}

impl VoteGroups {
    /// Refuses cells without votes and scores that are not finite.
    pub fn new(cells: &[&[ClipVote]]) -> Result<Self, StatisticsError> {
        for votes in cells {
            at_least("votes", 1, votes.len())?;
            votes.iter().try_for_each(|vote| finite("scores", &[vote.score]))?;
        }
        let shared = |vote: &ClipVote| [(vote.participant, 0), (0, vote.clip), (vote.participant, vote.clip)];
        let groups = [PARTICIPANT, CLIP, PAIR].map(|kind| {
            let keys: Vec<_> = cells.iter().flat_map(|votes| votes.iter().map(|vote| shared(vote)[kind])).collect();
            let mut numbers: BTreeMap<_, usize> = keys.iter().map(|key| (*key, 0)).collect();
            numbers.values_mut().enumerate().for_each(|(number, group)| *group = number);
            (keys.iter().map(|key| numbers[key]).collect(), numbers.len())
        });
        let n = [groups[PARTICIPANT].1, groups[CLIP].1, groups[PAIR].1];
        Ok(Self { of: groups.map(|(of, _)| of), n })
    }
}

/// Scores of the votes of all cells, one cell after the other.
pub(in super::super) fn scores(cells: &[&[ClipVote]]) -> Vec<f64> {
    cells.iter().flat_map(|votes| votes.iter().map(|vote| vote.score)).collect()
}
