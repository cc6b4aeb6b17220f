//! Randomisation test of the sides: exact over the plan's assignment of sides, under the sharp null that no choice
//! depends on the side of the real film, for any clip; easy clips that are balanced by hard ones also contradict this
//! null.

use super::super::estimate::{StatisticsError, at_least};
use statrs::distribution::{Discrete, Hypergeometric};

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
