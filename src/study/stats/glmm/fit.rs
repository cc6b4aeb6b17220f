//! Mixed logistic regression: log odds of success = intercept + random intercept of the participant + random intercept
//! of the clip, both normally distributed. Fitted by maximum likelihood with the Laplace approximation, like
//! `glmer(score ~ 1 + (1 | participant) + (1 | clip), family = binomial)` of lme4 (Bates et al. 2015). The likelihood
//! is maximised by BFGS (Broyden, Fletcher, Goldfarb, Shanno 1970) with central differences.

use super::laplace::Laplace;
use crate::stats::cluster::votes::{CLIP, ClipVote, PARTICIPANT, VoteGroups, scores};
use crate::stats::estimate::{ConfidenceInterval, StatisticsError, StudentEstimate, at_least};
use ndarray::{Array1, Array2, array};
use orator_base::math::cholesky;

/// Initial standard deviation of the search, log odds.
const INITIAL_SD: f64 = 0.4;
/// Standard deviation below which a variance component is set to 0, log odds.
const MIN_SD: f64 = 1e-3;

#[derive(Clone, Debug)]
pub struct MixedLogit {
    /// Log odds of a participant and clip with effect 0. Its t distribution has min(participants, clips) - 1 degrees of
    /// freedom, because Wald's test rejects too often with few clips.
    pub intercept: StudentEstimate,
    /// Standard deviations of the random intercepts, log odds; 0 if the fit is singular.
    pub sd_participants: f64,
    pub sd_clips: f64,
    pub log_likelihood: f64,
    pub converged: bool,
    /// Covariance [3, 3] of the two standard deviations and the intercept, in this order.
    covariance: Array2<f64>,
}

impl MixedLogit {
    /// Fits votes with scores 0 and 1.
    ///
    /// # Errors
    /// Fewer than two participants or clips, scores other than 0 and 1, or all votes equal.
    pub fn fit(votes: &[ClipVote]) -> Result<Self, StatisticsError> {
        let groups = VoteGroups::new(&[votes])?;
        at_least("participants", 2, groups.n[PARTICIPANT])?;
        at_least("clips", 2, groups.n[CLIP])?;
        let successes = scores(&[votes]);
        if let Some(&value) = successes.iter().find(|score| **score != 0.0 && **score != 1.0) {
            return Err(StatisticsError::OutOfRange { what: "score of a binary vote", value, min: 0.0, max: 1.0 });
        }
        let (n, share) = (votes.len() as f64, successes.iter().sum::<f64>() / votes.len() as f64);
        if share == 0.0 || share == 1.0 {
            return Err(StatisticsError::NoVariation { what: "votes" });
        }
        // Parameters are scaled by their approximate standard errors, so that the curvature is about 1.
        let n_groups = groups.n[PARTICIPANT].min(groups.n[CLIP]) as f64;
        let of_sd = 1.0 / (2.0 * n_groups).sqrt();
        let units = array![of_sd, of_sd, 1.0 / (n * share * (1.0 - share)).sqrt()];
        let mut laplace = Laplace::new(&groups, &successes);
        let mut value = |at: &Array1<f64>| {
            let parameters = at * &units;
            laplace.negative_log_likelihood(parameters[2], [parameters[0], parameters[1]])
        };
        let first = array![INITIAL_SD, INITIAL_SD, (share / (1.0 - share)).ln()] / &units;
        let mut best = minimum(&mut value, first);
        for k in 0..2 {
            if (best.at[k] * units[k]).abs() < MIN_SD {
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

    /// Marginal proportion of successes, averaged over the random intercepts, with an interval that is symmetric in log
    /// odds (delta method, t distribution of the intercept).
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

/// Logistic function: probability at these log odds.
pub fn logistic(log_odds: f64) -> f64 {
    1.0 / (1.0 + (-log_odds).exp())
}

/// Mean of the logistic function of a normal variable, its derivatives with respect to the mean and the variance (the
/// latter is half the second derivative with respect to the mean). Sums over ±8 standard deviations in steps of 1/16.
pub fn integrated(mean: f64, sd: f64) -> (f64, f64, f64) {
    let points = (-128..=128).map(|k| f64::from(k) / 16.0);
    let sums = points.fold((0.0, 0.0, 0.0, 0.0), |(total, a, b, c), z| {
        let (weight, p) = ((-0.5 * z * z).exp(), logistic(mean + sd * z));
        let slope = p * (1.0 - p);
        (total + weight, a + weight * p, b + weight * slope, c + weight * slope * (0.5 - p))
    });
    (sums.1 / sums.0, sums.2 / sums.0, sums.3 / sums.0)
}

/// Inverse of the Hessian. If it is not positive definite, the standard deviations are treated as known and their
/// covariances with the intercept as 0.
fn inverse(mut second: Array2<f64>) -> Array2<f64> {
    if !is_positive_definite(&second) {
        for k in 0..2 {
            second.row_mut(k).fill(0.0);
            second.column_mut(k).fill(0.0);
            // Practically infinite information, hence no variance.
            second[[k, k]] = 1e12;
        }
    }
    let n = second.nrows();
    cholesky::solve(second, Array2::eye(n))
}

fn is_positive_definite(matrix: &Array2<f64>) -> bool {
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

const MAX_STEPS: usize = 200;
/// Steps of the finite differences for gradients and Hessians.
const GRADIENT_STEP: f64 = 1e-3;
const CURVATURE_STEP: f64 = 0.02;
/// Maximum gradient component at convergence.
const GRADIENT_TOLERANCE: f64 = 1e-4;

pub(super) struct Minimum {
    pub at: Array1<f64>,
    pub value: f64,
    pub converged: bool,
}

fn moved(at: &Array1<f64>, moves: &[(usize, f64)]) -> Array1<f64> {
    let mut moved = at.clone();
    moves.iter().for_each(|(k, step)| moved[*k] += step);
    moved
}

fn gradient_at(f: &mut impl FnMut(&Array1<f64>) -> f64, at: &Array1<f64>) -> Array1<f64> {
    (0..at.len())
        .map(|k| (f(&moved(at, &[(k, GRADIENT_STEP)])) - f(&moved(at, &[(k, -GRADIENT_STEP)]))) / (2.0 * GRADIENT_STEP))
        .collect()
}

/// Minimises `f` from `start`; a step is at most 5 in each parameter.
pub(super) fn minimum(mut f: impl FnMut(&Array1<f64>) -> f64, start: Array1<f64>) -> Minimum {
    let n = start.len();
    let (mut at, mut inverse) = (start, Array2::<f64>::eye(n));
    let (mut value, mut gradient) = (f(&at), gradient_at(&mut f, &at));
    for _ in 0..MAX_STEPS {
        if gradient.iter().all(|v| v.abs() < GRADIENT_TOLERANCE) {
            return Minimum { at, value, converged: true };
        }
        let mut direction = -inverse.dot(&gradient);
        if direction.dot(&gradient) >= 0.0 {
            inverse = Array2::eye(n);
            direction = -gradient.clone();
        }
        let longest = direction.iter().fold(0.0f64, |max, v| max.max(v.abs()));
        direction *= (5.0 / longest).min(1.0);
        let descent = direction.dot(&gradient);
        let mut share = 1.0;
        let (next, next_value) = loop {
            let next = &at + &(&direction * share);
            let next_value = f(&next);
            if next_value <= value + 1e-4 * share * descent {
                break (next, next_value);
            }
            share *= 0.4;
            if share < 1e-7 {
                // Finite differences cannot resolve a descent direction.
                let converged = gradient.iter().all(|v| v.abs() < 100.0 * GRADIENT_TOLERANCE);
                return Minimum { at, value, converged };
            }
        };
        let next_gradient = gradient_at(&mut f, &next);
        let (step, change) = (&next - &at, &next_gradient - &gradient);
        let along = step.dot(&change);
        if along > 1e-12 {
            let turned = inverse.dot(&change);
            let factor = (1.0 + change.dot(&turned) / along) / along;
            for i in 0..n {
                for j in 0..n {
                    inverse[[i, j]] += factor * step[i] * step[j] - (turned[i] * step[j] + step[i] * turned[j]) / along;
                }
            }
        }
        (at, value, gradient) = (next, next_value, next_gradient);
    }
    Minimum { at, value, converged: false }
}

/// Hessian [n, n] by central differences.
pub(super) fn curvature(mut f: impl FnMut(&Array1<f64>) -> f64, at: &Array1<f64>) -> Array2<f64> {
    let (n, h) = (at.len(), CURVATURE_STEP);
    let centre = f(at);
    let mut second = Array2::zeros((n, n));
    for i in 0..n {
        second[[i, i]] = (f(&moved(at, &[(i, h)])) + f(&moved(at, &[(i, -h)])) - 2.0 * centre) / (h * h);
        for j in 0..i {
            let mut corner = |a: f64, b: f64| f(&moved(at, &[(i, a), (j, b)]));
            let mixed = (corner(h, h) + corner(-h, -h) - corner(h, -h) - corner(-h, h)) / (4.0 * h * h);
            (second[[i, j]], second[[j, i]]) = (mixed, mixed);
        }
    }
    second
}
