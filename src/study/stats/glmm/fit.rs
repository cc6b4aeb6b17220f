//! Mixed logistic regression: log odds of success = intercept + intercept of the participant + intercept of the clip, the
//! latter two normally distributed. Maximum likelihood by Laplace's approximation, as `glmer(score ~ 1 +
//! (1 | participant) + (1 | clip), family = binomial)` of lme4 (Bates et al. 2015).

use super::laplace::Laplace;
use super::minimum::{curvature, minimum};
use crate::stats::cluster::votes::{CLIP, ClipVote, PARTICIPANT, VoteGroups, scores};
use crate::stats::estimate::{ConfidenceInterval, StatisticsError, StudentEstimate, at_least};
use ndarray::{Array1, Array2, array};
use orator_base::math::cholesky;

/// Standard deviation, in log odds, from which the search starts.
const FIRST_SD: f64 = 0.4;
/// Standard deviation below which a factor has no variance.
const NO_SD: f64 = 1e-3;

/// Fitted model.
#[derive(Clone, Debug)]
pub struct MixedLogit {
    /// Log odds of a typical participant and clip, by a t distribution of one degree of freedom less than the smaller number
    /// of participants and clips: Wald's test errs too often with few clips.
    pub intercept: StudentEstimate,
    /// Standard deviations of the random intercepts, in log odds; 0 where the votes show none.
    pub sd_participants: f64,
    pub sd_clips: f64,
    pub log_likelihood: f64,
    pub converged: bool,
    /// Covariance [3, 3] of both standard deviations and the intercept, in this order.
    covariance: Array2<f64>,
}

impl MixedLogit {
    /// Fits votes with scores 0 and 1. Refuses fewer than two participants or clips, and equal votes.
    pub fn fit(votes: &[ClipVote]) -> Result<Self, StatisticsError> {
        let groups = VoteGroups::new(&[votes])?;
        at_least("participants", 2, groups.n[PARTICIPANT])?;
        at_least("clips", 2, groups.n[CLIP])?;
        let successes = scores(&[votes]);
        if let Some(&value) = successes.iter().find(|score| **score != 0.0 && **score != 1.0) {
            return Err(StatisticsError::OutOfRange { what: "score of a binary vote", value, least: 0.0, most: 1.0 });
        }
        let (n, share) = (votes.len() as f64, successes.iter().sum::<f64>() / votes.len() as f64);
        if share == 0.0 || share == 1.0 {
            return Err(StatisticsError::NoSpread { what: "votes" });
        }
        // Parameters are counted in about their standard errors; the search starts from the model without random intercepts.
        let n_groups = groups.n[PARTICIPANT].min(groups.n[CLIP]) as f64;
        let of_sd = 1.0 / (2.0 * n_groups).sqrt();
        let units = array![of_sd, of_sd, 1.0 / (n * share * (1.0 - share)).sqrt()];
        let mut laplace = Laplace::new(&groups, &successes);
        let mut value = |at: &Array1<f64>| {
            let parameters = at * &units;
            laplace.negative_log_likelihood(parameters[2], [parameters[0], parameters[1]])
        };
        let first = array![FIRST_SD, FIRST_SD, (share / (1.0 - share)).ln()] / &units;
        let mut best = minimum(&mut value, first);
        for k in 0..2 {
            if (best.at[k] * units[k]).abs() < NO_SD {
                best.at[k] = 0.0;
                best.value = value(&best.at);
            }
        }
        let second = curvature(&mut value, &best.at);
        let back = Array2::from_diag(&units);
        let covariance = back.dot(&inverse(second)).dot(&back);
        let parameters = &best.at * &units;
        let error = covariance[[2, 2]].max(0.0).sqrt();
        Ok(Self {
            intercept: StudentEstimate::new(parameters[2], error, n_groups - 1.0)?,
            sd_participants: parameters[0].abs(),
            sd_clips: parameters[1].abs(),
            log_likelihood: -best.value,
            converged: best.converged,
            covariance,
        })
    }

    /// Share of success over all participants and clips: the mean over the random intercepts. The interval is symmetric in
    /// log odds, by the delta method and the t distribution of the intercept.
    pub fn share(&self, confidence: f64) -> Result<(f64, ConfidenceInterval), StatisticsError> {
        let sd = self.sd_participants.hypot(self.sd_clips);
        let (share, per_log_odds, per_variance) = integrated(self.intercept.value, sd);
        let [of_participants, of_clips] =
            [self.sd_participants, self.sd_clips].map(|of_factor| 2.0 * of_factor * per_variance);
        let slope = array![of_participants, of_clips, per_log_odds];
        let error = slope.dot(&self.covariance.dot(&slope)).max(0.0).sqrt() / (share * (1.0 - share));
        let freedom = self.intercept.degrees_of_freedom;
        let interval = StudentEstimate::new((share / (1.0 - share)).ln(), error, freedom)?.interval(confidence)?;
        Ok((share, ConfidenceInterval { low: logistic(interval.low), high: logistic(interval.high) }))
    }
}

/// Probability at these log odds.
pub fn logistic(log_odds: f64) -> f64 {
    1.0 / (1.0 + (-log_odds).exp())
}

/// Mean of the logistic function of a normal variable, and its derivatives by mean and by variance (half the second
/// derivative by the mean). Sum at steps of 1/16 of a standard deviation.
pub fn integrated(mean: f64, sd: f64) -> (f64, f64, f64) {
    let points = (-128..=128).map(|k| f64::from(k) / 16.0);
    let sums = points.fold((0.0, 0.0, 0.0, 0.0), |(total, a, b, c), z| {
        let (weight, p) = ((-0.5 * z * z).exp(), logistic(mean + sd * z));
        let slope = p * (1.0 - p);
        (total + weight, a + weight * p, b + weight * slope, c + weight * slope * (0.5 - p))
    });
    (sums.1 / sums.0, sums.2 / sums.0, sums.3 / sums.0)
}

/// Inverse of a curvature. Where it is not positive definite, the intercept loses what it has in common with the standard
/// deviations.
fn inverse(mut second: Array2<f64>) -> Array2<f64> {
    if !is_positive(&second) {
        for k in 0..2 {
            second.row_mut(k).fill(0.0);
            second.column_mut(k).fill(0.0);
            // Infinite information: no variance.
            second[[k, k]] = 1e12;
        }
    }
    let n = second.nrows();
    cholesky::solve(second, Array2::eye(n))
}

fn is_positive(matrix: &Array2<f64>) -> bool {
    let n = matrix.nrows();
    let mut rest = matrix.clone();
    for k in 0..n {
        if rest[[k, k]].is_nan() || rest[[k, k]] <= 1e-10 * matrix[[k, k]].abs() {
            return false;
        }
        for i in k + 1..n {
            let factor = rest[[i, k]] / rest[[k, k]];
            for j in k..n {
                rest[[i, j]] -= factor * rest[[k, j]];
            }
        }
    }
    true
}
