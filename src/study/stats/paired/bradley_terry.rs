//! Strengths of conditions such that one is preferred to another with log odds of the difference (Bradley and Terry
//! 1952), by maximum likelihood. A tie counts as half a win for each, a strength of preference as its share. Finite only
//! where wins lead from each condition to each other one (Ford 1957): no prior makes up for votes that are missing.

use super::votes::{Ballots, PairedVote, percentiles};
use crate::stats::error::{StatisticsError, at_least, tail, within};
use crate::stats::estimate::{ConfidenceInterval, StudentEstimate};
use ndarray::{Array1, Array2, Axis};
use orator_base::math::cholesky;
use rayon::prelude::*;

/// Most Newton steps.
const MOST: usize = 100;
/// Largest share of draws without finite strengths that an interval may leave out.
const LEFT_OUT: f64 = 0.05;

/// Strengths in log odds, of mean 0.
#[derive(Clone, Debug, PartialEq)]
pub struct BradleyTerry {
    pub strengths: Vec<f64>,
    /// Covariance [conditions, conditions] by the Fisher information, which takes votes for independent: too small where
    /// participants differ in taste.
    pub covariance: Array2<f64>,
    pub log_likelihood: f64,
}

impl BradleyTerry {
    pub fn fit(votes: &[PairedVote], n_conditions: usize) -> Result<Self, StatisticsError> {
        Ballots::new(votes, n_conditions)?;
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
        for _ in 0..MOST {
            let step = cholesky::solve(fit.information.clone(), fit.slope.clone().insert_axis(Axis(1)));
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
        let n = n_conditions as f64;
        // The information was lifted by 1 in the direction of the mean, in which it has no size.
        let covariance = cholesky::solve(fit.information, Array2::eye(n_conditions)) - 1.0 / n;
        Ok(Self { strengths: (strengths - mean).to_vec(), covariance, log_likelihood: fit.log })
    }

    /// Strength of `first` less that of `second`.
    pub fn difference(&self, first: usize, second: usize) -> Result<StudentEstimate, StatisticsError> {
        let most = self.strengths.len() as f64 - 1.0;
        [first, second].iter().try_for_each(|condition| within("condition", *condition as f64, 0.0..=most))?;
        let at = |a, b| self.covariance[[a, b]];
        let variance = at(first, first) + at(second, second) - 2.0 * at(first, second);
        StudentEstimate::new(self.strengths[first] - self.strengths[second], variance.max(0.0).sqrt(), f64::INFINITY)
    }

    /// Interval of each strength by the Fisher information.
    pub fn intervals(&self, confidence: f64) -> Result<Vec<ConfidenceInterval>, StatisticsError> {
        let of = |(strength, variance): (&f64, &f64)| {
            StudentEstimate::new(*strength, variance.sqrt(), f64::INFINITY)?.interval(confidence)
        };
        self.strengths.iter().zip(self.covariance.diag()).map(of).collect()
    }
}

/// Percentile interval of each strength by `n_draws` draws of participants with replacement. Draws without finite
/// strengths are left out; more than 5 % of them are an error. Threads do not change a byte.
pub fn participant_intervals(
    votes: &[PairedVote],
    n_conditions: usize,
    confidence: f64,
    n_draws: usize,
    seed: u64,
) -> Result<Vec<ConfidenceInterval>, StatisticsError> {
    tail(confidence)?;
    at_least("draws", 1, n_draws)?;
    let ballots = Ballots::new(votes, n_conditions)?;
    let fit = |draw: u64| BradleyTerry::fit(&ballots.drawn(seed, draw), n_conditions).ok();
    let draws: Vec<Vec<f64>> =
        (0..n_draws as u64).into_par_iter().filter_map(|draw| fit(draw).map(|model| model.strengths)).collect();
    if (draws.len() as f64) < (1.0 - LEFT_OUT) * n_draws as f64 {
        return Err(StatisticsError::Unconnected { what: "conditions" });
    }
    percentiles(&draws, confidence)
}

/// Log-likelihood, its slope, and the information lifted by 1 / n in all places.
struct Likelihood {
    log: f64,
    slope: Array1<f64>,
    information: Array2<f64>,
}

fn likelihood(wins: &Array2<f64>, strengths: &Array1<f64>) -> Likelihood {
    let n = strengths.len();
    let mut found =
        Likelihood { log: 0.0, slope: Array1::zeros(n), information: Array2::from_elem((n, n), 1.0 / n as f64) };
    for ((i, j), won) in wins.indexed_iter().filter(|((i, j), _)| i != j) {
        let eta = strengths[i] - strengths[j];
        let share = 1.0 / (1.0 + (-eta).exp());
        found.log -= won * ((-eta).max(0.0) + (-eta.abs()).exp().ln_1p());
        found.slope[i] += won * (1.0 - share);
        found.slope[j] -= won * (1.0 - share);
        let weight = won * share * (1.0 - share);
        for (a, b, sign) in [(i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)] {
            found.information[[a, b]] += sign * weight;
        }
    }
    found
}

/// Whether wins lead from each condition to each other one.
fn is_connected(wins: &Array2<f64>) -> bool {
    let reaches_all = |won: &dyn Fn(usize, usize) -> f64| {
        let n = wins.nrows();
        let mut reached = vec![false; n];
        let mut waiting = vec![0];
        reached[0] = true;
        while let Some(i) = waiting.pop() {
            let next: Vec<usize> = (0..n).filter(|j| !reached[*j] && won(i, *j) > 0.0).collect();
            next.iter().for_each(|j| reached[*j] = true);
            waiting.extend(next);
        }
        reached.into_iter().all(|is| is)
    };
    reaches_all(&|i, j| wins[[i, j]]) && reaches_all(&|i, j| wins[[j, i]])
}
