//! Elo ratings: after each vote both conditions move by K times what the vote said less what the ratings foretold. The
//! result hangs on the order of votes, so it is the mean over many random orders (Chiang et al. 2024).

use super::votes::{Ballots, PairedVote, percentiles};
use crate::stats::error::{StatisticsError, at_least, tail, within};
use crate::stats::estimate::ConfidenceInterval;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// How ratings move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EloSettings {
    /// Points that a vote moves at most.
    pub k: f64,
    /// Points that make odds of 10.
    pub scale: f64,
    /// Rating before the first vote, and the mean of all.
    pub start: f64,
    /// Random orders of which the mean is taken.
    pub n_orders: usize,
}

impl Default for EloSettings {
    fn default() -> Self {
        Self { k: 4.0, scale: 400.0, start: 1000.0, n_orders: 100 }
    }
}

impl EloSettings {
    fn check(&self) -> Result<(), StatisticsError> {
        within("K", self.k, f64::MIN_POSITIVE..=1e6)?;
        within("scale", self.scale, 1e-3..=1e6)?;
        within("start", self.start, -1e6..=1e6)?;
        at_least("orders", 1, self.n_orders)
    }

    /// Ratings after the votes in this order.
    fn rated(&self, votes: &[PairedVote], n_conditions: usize) -> Vec<f64> {
        let mut ratings = vec![self.start; n_conditions];
        for vote in votes {
            let gap = ratings[vote.second] - ratings[vote.first];
            let moved = self.k * (vote.share - 1.0 / (1.0 + 10f64.powf(gap / self.scale)));
            ratings[vote.first] += moved;
            ratings[vote.second] -= moved;
        }
        ratings
    }

    fn mean(&self, mut votes: Vec<PairedVote>, n_conditions: usize, seed: u64, n_orders: usize) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        // Where votes come from another file they may stand in another order.
        votes.sort_by(|a, b| {
            let key = |vote: &PairedVote| (vote.participant, vote.first, vote.second);
            key(a).cmp(&key(b)).then(a.share.total_cmp(&b.share))
        });
        let mut sums = vec![0.0; n_conditions];
        for _ in 0..n_orders {
            votes.shuffle(&mut rng);
            sums.iter_mut().zip(self.rated(&votes, n_conditions)).for_each(|(sum, rating)| *sum += rating);
        }
        sums.iter().map(|sum| sum / n_orders as f64).collect()
    }

    /// Rating of each condition; the order of `votes` has no effect.
    pub fn ratings(&self, votes: &[PairedVote], n_conditions: usize, seed: u64) -> Result<Vec<f64>, StatisticsError> {
        self.check()?;
        Ballots::new(votes, n_conditions)?;
        Ok(self.mean(votes.to_vec(), n_conditions, seed, self.n_orders))
    }

    /// Percentile interval of each rating by `n_draws` draws of participants with replacement, each in ten random
    /// orders. Threads do not change a byte.
    pub fn participant_intervals(
        &self,
        votes: &[PairedVote],
        n_conditions: usize,
        confidence: f64,
        n_draws: usize,
        seed: u64,
    ) -> Result<Vec<ConfidenceInterval>, StatisticsError> {
        self.check()?;
        tail(confidence)?;
        at_least("draws", 1, n_draws)?;
        let ballots = Ballots::new(votes, n_conditions)?;
        let one =
            |draw: u64| self.mean(ballots.drawn(seed, draw), n_conditions, seed ^ (draw + 1), self.n_orders.min(10));
        percentiles(&(0..n_draws as u64).into_par_iter().map(one).collect::<Vec<_>>(), confidence)
    }
}
