//! Scores by participant and clip, how they are grouped by them, and means of participants: their scores on the chosen
//! clips, for other participants of the same kind. Such means assume that participants are independent of each other; the
//! clips count as given, and the p value is that of the hypothesis that the mean over these clips is chance. Where clips are
//! a sample, `crossed` is the test: with 100 participants, 20 votes each and 40 clips whose log odds vary by 0.3, a t test of
//! participants' means rejects a true hypothesis in 14 % of studies instead of 5 %.

use super::super::estimate::{StatisticsError, StudentEstimate, at_least, finite};
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
    pub(crate) fn new(cells: &[&[ClipVote]]) -> Result<Self, StatisticsError> {
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

/// Mean score of each participant, in the order of their numbers.
pub fn participant_means(votes: &[ClipVote]) -> Result<Vec<f64>, StatisticsError> {
    Ok(means_by_cell(&[votes])?.into_iter().map(|means| means[0]).collect())
}

/// Mean of the participants' mean scores, each participant with the same weight.
pub fn participant_estimate(votes: &[ClipVote]) -> Result<StudentEstimate, StatisticsError> {
    StudentEstimate::of_mean(&participant_means(votes)?)
}

/// Mean score in `first` less that in `second` of each participant who voted in both.
pub fn participant_differences(first: &[ClipVote], second: &[ClipVote]) -> Result<Vec<f64>, StatisticsError> {
    let differences = means_by_cell(&[first, second])?.into_iter().map(|means| means[0] - means[1]);
    Ok(differences.filter(|difference| difference.is_finite()).collect())
}

/// Mean score of each participant in each of two cells at most, NaN without a vote.
fn means_by_cell(cells: &[&[ClipVote]]) -> Result<Vec<[f64; 2]>, StatisticsError> {
    let groups = VoteGroups::new(cells)?;
    let mut sums = vec![[(0.0, 0.0); 2]; groups.n[PARTICIPANT]];
    let votes = cells.iter().enumerate().flat_map(|(cell, votes)| votes.iter().map(move |vote| (cell, vote.score)));
    for ((cell, score), participant) in votes.zip(&groups.of[PARTICIPANT]) {
        let (n, sum) = &mut sums[*participant][cell];
        *n += 1.0;
        *sum += score;
    }
    Ok(sums.into_iter().map(|cells| cells.map(|(n, sum)| sum / n)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn votes(scores: &[(usize, usize, f64)]) -> Vec<ClipVote> {
        scores.iter().map(|&(participant, clip, score)| ClipVote { participant, clip, score }).collect()
    }

    #[test]
    fn each_participant_counts_once() {
        let many = votes(&[(7, 0, 1.0), (7, 1, 1.0), (7, 2, 0.0), (7, 3, 0.0), (2, 0, 1.0), (9, 1, 0.0)]);
        assert_eq!(participant_means(&many), Ok(vec![1.0, 0.5, 0.0]));
        let estimate = participant_estimate(&many).unwrap();
        assert_eq!((estimate.value, estimate.degrees_of_freedom), (0.5, 2.0));
        assert!((estimate.standard_error - (0.25f64 / 3.0).sqrt()).abs() < 1e-15);
        let other = votes(&[(7, 5, 1.0), (9, 5, 1.0), (11, 5, 1.0)]);
        assert_eq!(participant_differences(&other, &many), Ok(vec![0.5, 1.0]));
    }

    #[test]
    fn one_participant_has_no_estimate() {
        assert!(matches!(participant_estimate(&votes(&[(1, 0, 1.0)])), Err(StatisticsError::TooFew { .. })));
        assert!(participant_estimate(&[]).is_err() && participant_means(&votes(&[(1, 0, f64::NAN)])).is_err());
        let right = votes(&[(1, 0, 1.0), (2, 0, 1.0)]);
        assert!(matches!(participant_estimate(&right), Err(StatisticsError::NoSpread { .. })));
    }
}
