//! Bradley-Terry model (Bradley and Terry 1952): strengths of conditions whose difference is the log odds that one is
//! preferred to the other, by maximum likelihood; also on the Elo scale of the GENEA leaderboard (Nagy et al. 2024) and
//! Chatbot Arena (Chiang et al. 2024). A tie counts as half a win for each side, a graded preference as its share.
//! Without a prior, strengths are finite only if every condition reaches every other by a chain of wins (Ford 1957).

use super::estimate::{ConfidenceInterval, StatisticsError, at_least, interval_of_draws, within};
use ndarray::{Array1, Array2, Axis};
use orator_base::math::cholesky;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::collections::BTreeMap;

const MAX_STEPS: usize = 100;
/// Maximum proportion of bootstrap draws without finite strengths.
const MAX_FAILED_DRAWS: f64 = 0.05;

/// Vote of one participant between two conditions, given by index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairedVote {
    pub participant: usize,
    pub first: usize,
    pub second: usize,
    /// 1 for the first condition, 0 for the second, 0.5 for a tie; graded preferences lie between.
    pub share: f64,
}

/// Validates votes.
///
/// # Errors
/// Fewer than two conditions, no votes, one compared with itself, an index out of range, a share outside 0 to 1.
fn check(votes: &[PairedVote], n_conditions: usize) -> Result<(), StatisticsError> {
    at_least("conditions", 2, n_conditions)?;
    at_least("votes", 1, votes.len())?;
    for vote in votes {
        within("share of a vote", vote.share, 0.0..=1.0)?;
        for condition in [vote.first, vote.second] {
            within("condition", condition as f64, 0.0..=n_conditions as f64 - 1.0)?;
        }
        at_least("conditions in a vote", 2, if vote.first == vote.second { 1 } else { 2 })?;
    }
    Ok(())
}

/// Maximum-likelihood strengths in log odds, with mean 0.
///
/// # Errors
/// Invalid votes, or conditions that wins do not connect in both directions.
pub fn strengths(votes: &[PairedVote], n_conditions: usize) -> Result<Vec<f64>, StatisticsError> {
    check(votes, n_conditions)?;
    let mut wins = Array2::<f64>::zeros((n_conditions, n_conditions));
    for vote in votes {
        wins[[vote.first, vote.second]] += vote.share;
        wins[[vote.second, vote.first]] += 1.0 - vote.share;
    }
    if !is_connected(&wins) {
        return Err(StatisticsError::Unconnected { what: "conditions" });
    }
    let mut strengths = Array1::<f64>::zeros(n_conditions);
    let mut fit = likelihood(&wins, &strengths);
    for _ in 0..MAX_STEPS {
        let step = cholesky::solve(fit.information.clone(), fit.gradient.clone().insert_axis(Axis(1)));
        let step = step.remove_axis(Axis(1));
        let mut share = 1.0;
        let (next, next_fit) = loop {
            let next = &strengths + &(&step * share);
            let next_fit = likelihood(&wins, &next);
            if next_fit.log >= fit.log - 1e-12 * fit.log.abs() || share < 1e-6 {
                break (next, next_fit);
            }
            share *= 0.5;
        };
        (strengths, fit) = (next, next_fit);
        if step.iter().all(|v| v.abs() < 1e-10) {
            break;
        }
    }
    let mean = strengths.mean().unwrap_or_default();
    Ok((strengths - mean).to_vec())
}

/// Percentile bootstrap interval of each strength, from `n_draws` resamples of participants. Draws without finite
/// strengths are ignored; more than 5 % of them are an error. Results do not depend on the number of threads.
pub fn strength_intervals(
    votes: &[PairedVote],
    n_conditions: usize,
    confidence: f64,
    n_draws: usize,
    seed: u64,
) -> Result<Vec<ConfidenceInterval>, StatisticsError> {
    at_least("draws", 1, n_draws)?;
    let mut of_participants: BTreeMap<usize, Vec<PairedVote>> = BTreeMap::new();
    votes.iter().for_each(|vote| of_participants.entry(vote.participant).or_default().push(*vote));
    let ballots: Vec<Vec<PairedVote>> = of_participants.into_values().collect();
    let fit = |draw: u64| {
        // Each draw has its own stream, so results do not depend on the number of threads.
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(draw);
        let n = ballots.len() as u64;
        let drawn = (0..n).flat_map(|_| &ballots[rng.random_range(0..n) as usize]).copied();
        strengths(&drawn.collect::<Vec<_>>(), n_conditions).ok()
    };
    let draws: Vec<Vec<f64>> = (0..n_draws as u64).into_par_iter().filter_map(fit).collect();
    if (draws.len() as f64) < (1.0 - MAX_FAILED_DRAWS) * n_draws as f64 {
        return Err(StatisticsError::Unconnected { what: "conditions" });
    }
    let interval = |k: usize| interval_of_draws(draws.iter().map(|draw| draw[k]), confidence);
    (0..n_conditions).map(interval).collect()
}

/// Elo rating of a strength: a difference of 400 corresponds to odds of 10, and the mean rating is 1000.
pub fn elo(log_strength: f64) -> f64 {
    1000.0 + 400.0 / std::f64::consts::LN_10 * log_strength
}

/// Log-likelihood, its gradient [n], and the Fisher information [n, n]. 1 / n is added to every element of the
/// information to make it invertible: strengths are determined up to a constant only.
struct Likelihood {
    log: f64,
    gradient: Array1<f64>,
    information: Array2<f64>,
}

fn likelihood(wins: &Array2<f64>, strengths: &Array1<f64>) -> Likelihood {
    let n = strengths.len();
    let mut found =
        Likelihood { log: 0.0, gradient: Array1::zeros(n), information: Array2::from_elem((n, n), 1.0 / n as f64) };
    for ((i, j), won) in wins.indexed_iter().filter(|((i, j), _)| i != j) {
        let eta = strengths[i] - strengths[j];
        let share = 1.0 / (1.0 + (-eta).exp());
        found.log -= won * ((-eta).max(0.0) + (-eta.abs()).exp().ln_1p());
        found.gradient[i] += won * (1.0 - share);
        found.gradient[j] -= won * (1.0 - share);
        let weight = won * share * (1.0 - share);
        for (a, b, sign) in [(i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)] {
            found.information[[a, b]] += sign * weight;
        }
    }
    found
}

/// Whether every condition reaches every other by a chain of wins: transitive closure by Warshall's algorithm.
fn is_connected(wins: &Array2<f64>) -> bool {
    let n = wins.nrows();
    let mut reaches = wins.mapv(|won| won > 0.0);
    for via in 0..n {
        for from in 0..n {
            for to in 0..n {
                reaches[[from, to]] |= reaches[[from, via]] && reaches[[via, to]];
            }
        }
    }
    reaches.iter().all(|reaches| *reaches)
}
