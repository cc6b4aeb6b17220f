//! Votes between two conditions, and draws of their participants.

use crate::stats::error::{StatisticsError, at_least, finite, tail, within};
use crate::stats::estimate::ConfidenceInterval;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;

/// Vote of one participant between two conditions, by their numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairedVote {
    pub participant: usize,
    pub first: usize,
    pub second: usize,
    /// 1 for the first condition, 0 for the second, 0.5 for a tie; strengths of preference lie between.
    pub share: f64,
}

/// Votes of each participant.
pub(super) struct Ballots(Vec<Vec<PairedVote>>);

impl Ballots {
    /// Refuses votes of a condition with itself, of conditions from `n_conditions` on, and shares outside 0 to 1.
    pub fn new(votes: &[PairedVote], n_conditions: usize) -> Result<Self, StatisticsError> {
        at_least("conditions", 2, n_conditions)?;
        at_least("votes", 1, votes.len())?;
        let mut of: BTreeMap<usize, Vec<PairedVote>> = BTreeMap::new();
        for vote in votes {
            within("share of a vote", vote.share, 0.0..=1.0)?;
            for condition in [vote.first, vote.second] {
                within("condition", condition as f64, 0.0..=n_conditions as f64 - 1.0)?;
            }
            if vote.first == vote.second {
                return Err(StatisticsError::TooFew { what: "conditions in a vote", least: 2, found: 1 });
            }
            of.entry(vote.participant).or_default().push(*vote);
        }
        Ok(Self(of.into_values().collect()))
    }

    /// Votes of as many participants, drawn with replacement by stream `draw` of `seed`.
    pub fn drawn(&self, seed: u64, draw: u64) -> Vec<PairedVote> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(draw);
        let n = self.0.len();
        (0..n).flat_map(|_| self.0[rng.random_range(0..n as u64) as usize].iter().copied()).collect()
    }
}

/// Percentile interval of each column of `draws`.
pub(super) fn percentiles(draws: &[Vec<f64>], confidence: f64) -> Result<Vec<ConfidenceInterval>, StatisticsError> {
    let tail = tail(confidence)?;
    at_least("draws", 1, draws.len())?;
    let of_column = |column: usize| {
        let mut values: Vec<f64> = draws.iter().map(|draw| draw[column]).collect();
        finite("draws", &values)?;
        values.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let place = share * (values.len() - 1) as f64;
            let (below, above) = (values[place.floor() as usize], values[place.ceil() as usize]);
            below + (above - below) * place.fract()
        };
        Ok(ConfidenceInterval { low: at(tail), high: at(1.0 - tail) })
    };
    (0..draws[0].len()).map(of_column).collect()
}
