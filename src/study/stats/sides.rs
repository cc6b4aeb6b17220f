//! Randomisation test of the plan's own draw: which side the real film was on. Assumes nothing about participants or
//! clips, only that the plan drew sides at random. It tests the sharp hypothesis that nobody's choice depends on where
//! the real film is, for any clip. Easy clips that hard ones outweigh contradict it and may lead to its rejection.

use super::estimate::{StatisticsError, at_least};
use statrs::distribution::{Discrete, Hypergeometric};

/// Trials among which the plan fixed how often the real film is on the left and drew at random in which: those of a
/// participant, or of a participant and a condition. Of trials whose sides were drawn one by one,
/// `BinomialCount::test` is the exact test.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SideBlock {
    trials: u64,
    real_left: u64,
    chosen_left: u64,
    /// Trials in which the left film was both real and chosen.
    left_hits: u64,
}

impl SideBlock {
    /// Adds a trial.
    pub fn push(&mut self, real_left: bool, chosen_left: bool) {
        self.trials += 1;
        self.real_left += u64::from(real_left);
        self.chosen_left += u64::from(chosen_left);
        self.left_hits += u64::from(real_left && chosen_left);
    }
}

/// Two-sided p value of the exact test over all draws of sides that leave the number of real films on the left of each block: a sum of
/// hypergeometric counts (Fisher 1935), by convolution.
pub fn side_p(blocks: &[SideBlock]) -> Result<f64, StatisticsError> {
    let trials: u64 = blocks.iter().map(|block| block.trials).sum();
    at_least("trials", 1, trials.min(1) as usize)?;
    // Probabilities of the number of left hits.
    let mut distribution = vec![1.0];
    let mut mean = 0.0;
    for block in blocks.iter().filter(|block| block.trials > 0) {
        let counts = Hypergeometric::new(block.trials, block.real_left, block.chosen_left);
        let most = block.real_left.min(block.chosen_left);
        let weights: Vec<f64> = (0..=most).map(|k| counts.as_ref().map_or(0.0, |counts| counts.pmf(k))).collect();
        let mut sums = vec![0.0; distribution.len() + most as usize];
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
    use super::*;

    fn block(trials: &[(bool, bool)]) -> SideBlock {
        let mut block = SideBlock::default();
        trials.iter().for_each(|(real, chosen)| block.push(*real, *chosen));
        block
    }

    /// Two blocks of three trials, one real film on the left in the first, two in the second: all nine draws.
    #[test]
    fn p_is_the_share_of_all_draws() {
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
    fn who_always_chooses_left_shows_nothing() {
        let left = block(&[(true, true), (false, true), (true, true), (false, true)]);
        assert_eq!(side_p(&[left, SideBlock::default()]), Ok(1.0));
        assert!(side_p(&[]).is_err() && side_p(&[SideBlock::default()]).is_err());
    }
}
