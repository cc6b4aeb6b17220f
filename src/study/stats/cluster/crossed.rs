//! Mean score with a standard error that accounts for sampling participants and clips: crossed variance components and
//! a t distribution with Satterthwaite's degrees of freedom. Assumes independent samples of participants and clips, and
//! that votes sharing neither are independent. At least two of both are required; the t approximation needs about 20.

use super::super::estimate::{StatisticsError, StudentEstimate, at_least};
use super::votes::{CLIP, ClipVote, PAIR, PARTICIPANT, VoteGroups, scores};
use std::ops::Range;

/// Mean of all votes with equal weights.
///
/// # Errors
/// There are fewer than two participants or clips, a score is not finite, or the estimated variance is 0.
pub fn crossed_estimate(votes: &[ClipVote]) -> Result<StudentEstimate, StatisticsError> {
    estimate(&[votes], &[1.0])
}

/// Difference of means of `first` and `second`. Participants and clips may occur in both; common effects then cancel.
///
/// # Errors
/// A cell has fewer than two participants or clips, a score is not finite, or the estimated variance is 0.
pub fn crossed_difference(first: &[ClipVote], second: &[ClipVote]) -> Result<StudentEstimate, StatisticsError> {
    estimate(&[first, second], &[1.0, -1.0])
}

/// Weighted sum of the cells' means, with degrees of freedom by Satterthwaite (1946) from effective numbers of groups.
fn estimate(cells: &[&[ClipVote]], weights: &[f64]) -> Result<StudentEstimate, StatisticsError> {
    let groups = VoteGroups::new(cells)?;
    let mut start = 0;
    let mut contrast = Contrast(Vec::new());
    for (votes, weight) in cells.iter().zip(weights) {
        // Two of both guarantee that some two votes share neither a participant nor a clip.
        let own = VoteGroups::new(&[votes])?;
        at_least("participants", 2, own.n[PARTICIPANT])?;
        at_least("clips", 2, own.n[CLIP])?;
        contrast.0.push((start..start + votes.len(), *weight));
        start += votes.len();
    }
    // Without this check, rounding would give equal scores a tiny variance above 0.
    if cells.iter().all(|votes| votes.iter().all(|vote| vote.score == votes[0].score)) {
        return Err(StatisticsError::NoVariation { what: "scores" });
    }
    let scores = scores(cells);
    let variance = contrast.variance(&groups, &scores);
    let freedom = variance.degrees_of_freedom(contrast.effective_groups(&groups));
    StudentEstimate::new(contrast.value(&scores), variance.total().sqrt(), freedom)
}

/// Linear contrast: cells (ranges of the votes) with the weights of their means.
pub(in super::super) struct Contrast(pub Vec<(Range<usize>, f64)>);

/// Variance components of a contrast: participants, clips and residual (single votes). Negative estimates are set to 0.
pub(in super::super) struct CrossedVariance {
    parts: [f64; 3],
}

impl CrossedVariance {
    pub(crate) fn total(&self) -> f64 {
        self.parts.iter().sum()
    }

    /// Degrees of freedom of the total variance (Satterthwaite 1946) from mean squares of participants, clips and
    /// residual with degrees of freedom `of`. The expected ones of participants and clips contain the residual.
    fn degrees_of_freedom(&self, of: [f64; 3]) -> f64 {
        let [participants, clips, votes] = self.parts;
        let share = |part: f64, freedom: f64| part * part / freedom;
        let error = match (participants > 0.0, clips > 0.0) {
            (true, true) => share(participants + votes, of[0]) + share(clips + votes, of[1]) + share(votes, of[2]),
            (true, false) => share(participants + votes, of[0]),
            (false, true) => share(clips + votes, of[1]),
            (false, false) => share(votes, of[2]),
        };
        (self.total().powi(2) / error).max(1.0)
    }
}

impl Contrast {
    pub(crate) fn value(&self, scores: &[f64]) -> f64 {
        self.0.iter().map(|(cell, weight)| weight * mean(&scores[cell.clone()])).sum()
    }

    /// Covariances of votes that share a participant, a clip or both: means of products of deviations, less the mean
    /// product of votes that share nothing. Unbiased for balanced designs, where they equal those of the analysis of
    /// variance. Their sum is the two-way clustered variance of Cameron, Gelbach and Miller (2011) up to its divisor.
    /// If every two votes share something, the mean product subtracted is 0.
    pub(crate) fn variance(&self, groups: &VoteGroups, scores: &[f64]) -> CrossedVariance {
        let sums: Vec<[Vec<(f64, f64)>; 3]> = self.0.iter().map(|(cell, _)| group_sums(cell, groups, scores)).collect();
        let mut parts = [0.0; 3];
        for (a, (cell_a, weight_a)) in sums.iter().zip(&self.0) {
            for (b, (cell_b, weight_b)) in sums.iter().zip(&self.0) {
                // Numbers of pairs of votes and sums of their products; pairs that share both are counted in all three.
                let [participants, clips, both] = [PARTICIPANT, CLIP, PAIR].map(|kind| {
                    let pairs = a[kind].iter().zip(&b[kind]);
                    pairs.fold((0.0, 0.0), |(n, sum), (a, b)| (n + a.0 * b.0, sum + a.1 * b.1))
                });
                let all = (cell_a.len() * cell_b.len()) as f64;
                let n_apart = all - participants.0 - clips.0 + both.0;
                // Deviations add up to 0, hence so do the products over all pairs.
                let apart = if n_apart > 0.0 { (both.1 - participants.1 - clips.1) / n_apart } else { 0.0 };
                let weight = weight_a * weight_b / all;
                let covariance = |(n, sum): (f64, f64)| weight * (sum - n * apart);
                parts[PARTICIPANT] += covariance((participants.0 - both.0, participants.1 - both.1));
                parts[CLIP] += covariance((clips.0 - both.0, clips.1 - both.1));
                parts[PAIR] += covariance(both);
            }
        }
        CrossedVariance { parts: parts.map(|part| part.max(0.0)) }
    }

    /// Effective numbers of participants, clips and pairs, in which groups with few votes count less (Carter, Schnepel
    /// and Steigerwald 2017), less the number of estimated means: one if a group occurs in several cells, otherwise one
    /// per cell.
    fn effective_groups(&self, groups: &VoteGroups) -> [f64; 3] {
        [PARTICIPANT, CLIP, PAIR].map(|kind| {
            let mut shares = vec![0.0; groups.n[kind]];
            let mut is_shared = false;
            for (cell, _) in &self.0 {
                let before = shares.clone();
                for vote in cell.clone() {
                    let group = groups.of[kind][vote];
                    shares[group] += 1.0 / cell.len() as f64;
                    is_shared |= before[group] > 0.0;
                }
            }
            let (sum, squares) = shares.iter().fold((0.0, 0.0), |(sum, squares), s| (sum + s, squares + s * s));
            let n_means = if is_shared { 1 } else { self.0.len() };
            (sum * sum / squares - n_means as f64).max(1.0)
        })
    }
}

/// For each group, the number of its votes and the sum of their deviations from the cell's mean.
fn group_sums(cell: &Range<usize>, groups: &VoteGroups, scores: &[f64]) -> [Vec<(f64, f64)>; 3] {
    let mean = mean(&scores[cell.clone()]);
    [PARTICIPANT, CLIP, PAIR].map(|kind| {
        let mut sums = vec![(0.0, 0.0); groups.n[kind]];
        for vote in cell.clone() {
            let (n, sum) = &mut sums[groups.of[kind][vote]];
            *n += 1.0;
            *sum += scores[vote] - mean;
        }
        sums
    })
}

fn mean(scores: &[f64]) -> f64 {
    scores.iter().sum::<f64>() / scores.len() as f64
}
