//! Randomisation tests. `sign_flip_p`: wild cluster bootstrap of the studentised mean with the null imposed (MacKinnon
//! et al. 2021), with participants and clips as samples; asymptotic, for deviations symmetric about the null. `side_p`:
//! exact test over the plan's assignment of sides, under the sharp null that no choice depends on the side of the real
//! film, for any clip; easy clips that are balanced by hard ones also contradict this null.

use super::super::estimate::{StatisticsError, at_least, finite};
use super::crossed::Contrast;
use super::votes::{CLIP, ClipVote, PARTICIPANT, VoteGroups};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use statrs::distribution::{Discrete, Hypergeometric};

/// Generator of one draw. Each draw has its own stream, so results do not depend on the number of threads.
pub(in super::super) fn rng_of_draw(seed: u64, draw: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(draw);
    rng
}

/// Two-sided p value of the hypothesis that the population mean over participants and clips is `expected`. The
/// deviations from `expected` are flipped jointly for all votes of a participant, or of a clip if those are fewer.
///
/// # Errors
/// There are fewer than two participants or clips, `n_draws` is 0, or a score or `expected` is not finite.
pub fn sign_flip_p(votes: &[ClipVote], expected: f64, n_draws: usize, seed: u64) -> Result<f64, StatisticsError> {
    finite("expected scores", &[expected])?;
    at_least("draws", 1, n_draws)?;
    let groups = VoteGroups::new(&[votes])?;
    at_least("participants", 2, groups.n[PARTICIPANT])?;
    at_least("clips", 2, groups.n[CLIP])?;
    let contrast = Contrast(vec![(0..votes.len(), 1.0)]);
    let statistic = |scores: &[f64]| {
        let mean = contrast.value(scores).abs();
        // Avoids 0 / 0 for scores without spread.
        if mean == 0.0 { 0.0 } else { mean / contrast.variance(&groups, scores).total().sqrt() }
    };
    let scores: Vec<f64> = votes.iter().map(|vote| vote.score - expected).collect();
    let observed = statistic(&scores) * (1.0 - 1e-12);
    let kind = if groups.n[CLIP] < groups.n[PARTICIPANT] { CLIP } else { PARTICIPANT };
    let is_far = |k: &u64| {
        let mut rng = rng_of_draw(seed, *k);
        let signs: Vec<f64> = (0..groups.n[kind]).map(|_| if rng.random() { 1.0 } else { -1.0 }).collect();
        let flipped: Vec<f64> = scores.iter().zip(&groups.of[kind]).map(|(s, group)| s * signs[*group]).collect();
        statistic(&flipped) >= observed
    };
    let n_far = (0..n_draws as u64).into_par_iter().filter(is_far).count();
    Ok((1 + n_far) as f64 / (1 + n_draws) as f64)
}

/// Trials of a participant, or of a participant and a condition, for which the plan fixes how often the real film is on
/// the left and randomises when. If sides were drawn independently per trial, `BinomialCount::test` is the exact test.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SideBlock {
    trials: u64,
    real_left: u64,
    chosen_left: u64,
    /// Number of trials in which the left film was both real and chosen.
    left_hits: u64,
}

impl SideBlock {
    pub fn push(&mut self, real_left: bool, chosen_left: bool) {
        self.trials += 1;
        self.real_left += u64::from(real_left);
        self.chosen_left += u64::from(chosen_left);
        self.left_hits += u64::from(real_left && chosen_left);
    }
}

/// Exact two-sided p value over all assignments of sides that preserve each block's number of real films on the left:
/// the distribution of a sum of hypergeometric counts (Fisher 1935), by convolution.
///
/// # Errors
/// There are no trials.
pub fn side_p(blocks: &[SideBlock]) -> Result<f64, StatisticsError> {
    let trials: u64 = blocks.iter().map(|block| block.trials).sum();
    at_least("trials", 1, trials.min(1) as usize)?;
    // Distribution of the total number of left hits.
    let mut distribution = vec![1.0];
    let mut mean = 0.0;
    for block in blocks.iter().filter(|block| block.trials > 0) {
        let counts = Hypergeometric::new(block.trials, block.real_left, block.chosen_left);
        let max_both = block.real_left.min(block.chosen_left);
        let weights: Vec<f64> = (0..=max_both).map(|k| counts.as_ref().map_or(0.0, |counts| counts.pmf(k))).collect();
        let mut sums = vec![0.0; distribution.len() + max_both as usize];
        for (k, before) in distribution.iter().enumerate() {
            weights.iter().zip(&mut sums[k..]).for_each(|(weight, sum)| *sum += before * weight);
        }
        distribution = sums;
        mean += block.real_left as f64 * block.chosen_left as f64 / block.trials as f64;
    }
    let hits: u64 = blocks.iter().map(|block| block.left_hits).sum();
    let far = (hits as f64 - mean).abs() - 1e-9;
    let outcomes = distribution.iter().enumerate().filter(|(k, _)| (*k as f64 - mean).abs() >= far);
    let p: f64 = outcomes.map(|(_, p)| p).sum();
    Ok(p.min(1.0))
}

#[cfg(test)]
mod tests {
    use super::super::crossed::crossed_estimate;
    use super::*;
    use crate::power::{CrossedDesign, CrossedEffects, crossed_votes};

    fn votes(stream: u64, share: f64) -> Vec<ClipVote> {
        let design = CrossedDesign { n_participants: 30, n_trials: 20, n_clips: 20 };
        crossed_votes(&design, &CrossedEffects { share, sd_participants: 0.8, sd_clips: 0.8 }, 2, stream)
    }

    #[test]
    fn results_do_not_depend_on_threads() {
        let (votes, alone) = (votes(1, 0.5), rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap());
        let p = || sign_flip_p(&votes, 0.5, 99, 3).unwrap();
        assert_eq!(p(), alone.install(p));
    }

    #[test]
    fn p_values_of_sign_flips_are_near_those_of_the_t_distribution() {
        for stream in 0..6 {
            let votes = votes(stream, 0.56);
            let flipped = sign_flip_p(&votes, 0.5, 1999, 1).unwrap();
            let student = crossed_estimate(&votes).unwrap().p_value(0.5);
            assert!((flipped - student).abs() < 0.05 + 0.1 * student, "{flipped} {student}");
        }
    }

    #[test]
    fn extreme_scores_and_invalid_arguments() {
        let all: Vec<ClipVote> = votes(4, 0.5).iter().map(|vote| ClipVote { score: 1.0, ..*vote }).collect();
        assert!(sign_flip_p(&all, 0.5, 999, 1).unwrap() < 0.01);
        assert_eq!(sign_flip_p(&all, 1.0, 99, 1), Ok(1.0));
        for (votes, expected, n_draws) in [(&all[..], 0.5, 0), (&all[..20], 0.5, 9), (&[], 0.5, 9), (&all, f64::NAN, 9)]
        {
            assert!(sign_flip_p(votes, expected, n_draws, 1).is_err());
        }
    }

    fn block(trials: &[(bool, bool)]) -> SideBlock {
        let mut block = SideBlock::default();
        trials.iter().for_each(|(real, chosen)| block.push(*real, *chosen));
        block
    }

    /// Two blocks of three trials with one and two real films on the left: compared with all nine assignments.
    #[test]
    fn p_is_the_share_of_all_assignments() {
        let (first, second) = ([true, false, false], [true, true, false]);
        for chosen in 0..64u32 {
            let chosen: Vec<bool> = (0..6).map(|k| chosen >> k & 1 == 1).collect();
            let right = |real: [bool; 3], chosen: &[bool]| (0..3).filter(|k| real[*k] == chosen[*k]).count() as f64;
            let mut draws = Vec::new();
            for a in 0..3 {
                for b in 0..3 {
                    let (mut x, mut y) = (first, second);
                    x.rotate_right(a);
                    y.rotate_right(b);
                    draws.push(right(x, &chosen[..3]) + right(y, &chosen[3..]));
                }
            }
            let mean = draws.iter().sum::<f64>() / 9.0;
            let far = |correct: f64| (correct - mean).abs();
            let p = draws.iter().filter(|draw| far(**draw) >= far(draws[0]) - 1e-9).count() as f64 / 9.0;
            let blocks = [(first, &chosen[..3]), (second, &chosen[3..])]
                .map(|(real, chosen)| block(&real.into_iter().zip(chosen.iter().copied()).collect::<Vec<_>>()));
            let found = side_p(&blocks).unwrap();
            assert!((found - p).abs() < 1e-12, "{found} {p}");
        }
    }

    #[test]
    fn always_choosing_left_is_no_evidence() {
        let left = block(&[(true, true), (false, true), (true, true), (false, true)]);
        assert_eq!(side_p(&[left, SideBlock::default()]), Ok(1.0));
        assert!(side_p(&[]).is_err() && side_p(&[SideBlock::default()]).is_err());
    }
}
