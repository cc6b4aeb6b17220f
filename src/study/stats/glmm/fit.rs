//! Mixed logistic regression: log odds of success = fixed effects + intercept of the participant + intercept of the
//! clip, both normally distributed. Maximum likelihood by Laplace's approximation, as `glmer(score ~ x +
//! (1 | participant) + (1 | clip), family = binomial)` of lme4 (Bates et al. 2015).

use super::laplace::Laplace;
use super::minimum::{curvature, minimum};
use crate::stats::cluster::votes::{CLIP, ClipVote, PARTICIPANT, VoteGroups, scores};
use crate::stats::error::{StatisticsError, at_least, finite, tail, within};
use crate::stats::estimate::{ConfidenceInterval, StudentEstimate};
use ndarray::{Array1, Array2, Axis, concatenate, s};
use orator_base::math::cholesky;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Standard deviation, in log odds, from which the search starts.
const FIRST_SD: f64 = 0.4;
/// Standard deviation below which a factor has no variance.
const NO_SD: f64 = 1e-3;
/// Log odds beyond which a plain logistic regression has no finite answer.
const SEPARATED: f64 = 30.0;

/// Fitted model.
#[derive(Clone, Debug)]
pub struct MixedLogit {
    /// Fixed effects, one for each column of the design, in log odds.
    pub estimates: Vec<f64>,
    pub standard_errors: Vec<f64>,
    /// Standard deviations of the random intercepts, in log odds; 0 where the votes show none.
    pub sd_participants: f64,
    pub sd_clips: f64,
    pub log_likelihood: f64,
    pub converged: bool,
    pub n_participants: usize,
    pub n_clips: usize,
    /// Covariance of both standard deviations and the fixed effects, in this order.
    covariance: Array2<f64>,
}

/// Share of success with its interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarginalShare {
    pub share: f64,
    pub interval: ConfidenceInterval,
}

impl MixedLogit {
    /// Fits votes with scores 0 and 1. A row of `design` [votes, effects] holds what multiplies the fixed effects of a
    /// vote; a column of ones is the intercept, no column at all leaves chance. Refuses fewer than two participants or
    /// clips, equal votes, columns that depend on each other, and columns that separate successes from failures.
    pub fn fit(votes: &[ClipVote], design: &Array2<f64>) -> Result<Self, StatisticsError> {
        at_least("rows of covariates", votes.len(), design.nrows())?;
        within("rows of covariates", design.nrows() as f64, 0.0..=votes.len() as f64)?;
        design.rows().into_iter().try_for_each(|row| finite("covariates", &row.to_vec()))?;
        let groups = VoteGroups::new(&[votes])?;
        at_least("participants", 2, groups.n[PARTICIPANT])?;
        at_least("clips", 2, groups.n[CLIP])?;
        let successes = scores(&[votes]);
        if let Some(wrong) = successes.iter().find(|score| **score != 0.0 && **score != 1.0) {
            return Err(StatisticsError::OutOfRange {
                what: "score of a binary vote",
                value: *wrong,
                least: 0.0,
                most: 1.0,
            });
        }
        if successes.iter().all(|score| *score == successes[0]) {
            return Err(StatisticsError::NoSpread { what: "votes" });
        }
        let plain = PlainLogit::fit(&Array1::from(successes.clone()), design)?;

        // Parameters are counted in about their standard errors.
        let n_effects = design.ncols();
        let unit = 1.0 / (2.0 * groups.n[PARTICIPANT].min(groups.n[CLIP]) as f64).sqrt();
        let mut laplace = Laplace::new(&groups, &successes);
        let mut value = |at: &Array1<f64>| {
            let linear = plain.columns.dot(&at.slice(s![2..]));
            laplace.negative_log_likelihood(linear.as_slice().unwrap_or_default(), [at[0] * unit, at[1] * unit])
        };
        let first = Array1::from_elem(2, FIRST_SD / unit);
        let mut best = minimum(&mut value, concatenate![Axis(0), first, plain.effects]);
        for k in 0..2 {
            let mut without = best.at.clone();
            without[k] = 0.0;
            if (best.at[k] * unit).abs() < NO_SD {
                best.value = value(&without);
                best.at = without;
            }
        }
        let second = curvature(&mut value, &best.at);
        let mut back = Array2::<f64>::eye(2 + n_effects) * unit;
        back.slice_mut(s![2.., 2..]).assign(&plain.to_effects);
        let covariance = back.dot(&inverse(&second)).dot(&back.t());
        let parameters = back.dot(&best.at);
        let errors = covariance.diag().iter().skip(2).map(|v| v.max(0.0).sqrt()).collect();
        Ok(Self {
            estimates: parameters.slice(s![2..]).to_vec(),
            standard_errors: errors,
            sd_participants: parameters[0].abs(),
            sd_clips: parameters[1].abs(),
            log_likelihood: -best.value,
            converged: best.converged,
            n_participants: groups.n[PARTICIPANT],
            n_clips: groups.n[CLIP],
            covariance,
        })
    }

    /// Fits the intercept alone.
    pub fn of_share(votes: &[ClipVote]) -> Result<Self, StatisticsError> {
        Self::fit(votes, &Array2::ones((votes.len(), 1)))
    }

    /// Whether a factor has no variance.
    pub fn is_singular(&self) -> bool {
        self.sd_participants == 0.0 || self.sd_clips == 0.0
    }

    /// Fixed effect with the normal distribution of Wald's test.
    pub fn wald(&self, effect: usize) -> Result<StudentEstimate, StatisticsError> {
        self.student(effect, f64::INFINITY)
    }

    /// Fixed effect with a t distribution of one degree of freedom less than the smaller of participants and clips: for
    /// the intercept, where Wald's test errs too often with few clips.
    pub fn containment(&self, effect: usize) -> Result<StudentEstimate, StatisticsError> {
        self.student(effect, self.n_participants.min(self.n_clips) as f64 - 1.0)
    }

    fn student(&self, effect: usize, degrees_of_freedom: f64) -> Result<StudentEstimate, StatisticsError> {
        within("effect", effect as f64, 0.0..=self.estimates.len() as f64 - 1.0)?;
        StudentEstimate::new(self.estimates[effect], self.standard_errors[effect], degrees_of_freedom)
    }

    /// p value of the likelihood ratio against a model of the same votes with a part of the columns.
    pub fn likelihood_ratio(&self, reduced: &Self) -> Result<f64, StatisticsError> {
        let n_dropped = self.estimates.len().saturating_sub(reduced.estimates.len());
        at_least("dropped effects", 1, n_dropped)?;
        let statistic = 2.0 * (self.log_likelihood - reduced.log_likelihood).max(0.0);
        let chi_squared = ChiSquared::new(n_dropped as f64);
        chi_squared.map(|law| law.sf(statistic)).map_err(|_| StatisticsError::NotFinite { what: "log-likelihoods" })
    }

    /// Share of success over all participants and clips for one row of the design: the mean over the random intercepts.
    /// The interval is symmetric in log odds, by the delta method and the t distribution of `containment`.
    pub fn marginal_share(&self, row: &[f64], confidence: f64) -> Result<MarginalShare, StatisticsError> {
        within("covariates", row.len() as f64, self.estimates.len() as f64..=self.estimates.len() as f64)?;
        finite("covariates", row)?;
        let log_odds: f64 = row.iter().zip(&self.estimates).map(|(x, effect)| x * effect).sum();
        let sd = self.sd_participants.hypot(self.sd_clips);
        let (share, per_log_odds, per_variance) = integrated(log_odds, sd);
        let per_sd = [self.sd_participants, self.sd_clips].map(|of_factor| 2.0 * of_factor * per_variance);
        let slope: Array1<f64> = per_sd.into_iter().chain(row.iter().map(|x| x * per_log_odds)).collect();
        let error = slope.dot(&self.covariance.dot(&slope)).max(0.0).sqrt() / (share * (1.0 - share));
        let freedom = self.n_participants.min(self.n_clips) as f64 - 1.0;
        tail(confidence)?;
        let interval = StudentEstimate::new((share / (1.0 - share)).ln(), error, freedom)?.interval(confidence)?;
        let interval = ConfidenceInterval { low: logistic(interval.low), high: logistic(interval.high) };
        Ok(MarginalShare { share, interval })
    }
}

fn logistic(log_odds: f64) -> f64 {
    1.0 / (1.0 + (-log_odds).exp())
}

/// Mean of the logistic function of a normal variable, and its derivatives by mean and by variance (half the second
/// derivative by the mean). Sum at steps of 1/16 of a standard deviation.
fn integrated(mean: f64, sd: f64) -> (f64, f64, f64) {
    let points = (-128..=128).map(|k| f64::from(k) / 16.0);
    let sums = points.fold((0.0, 0.0, 0.0, 0.0), |(total, a, b, c), z| {
        let (weight, p) = ((-0.5 * z * z).exp(), logistic(mean + sd * z));
        let slope = p * (1.0 - p);
        (total + weight, a + weight * p, b + weight * slope, c + weight * slope * (0.5 - p))
    });
    (sums.1 / sums.0, sums.2 / sums.0, sums.3 / sums.0)
}

/// Inverse of a curvature. Where it is not positive definite, parameters lose what they have in common with the first
/// two.
fn inverse(second: &Array2<f64>) -> Array2<f64> {
    let n = second.nrows();
    let mut second = second.clone();
    if !is_positive(&second) {
        for k in 0..2 {
            second.row_mut(k).fill(0.0);
            second.column_mut(k).fill(0.0);
            // Infinite information: no variance.
            second[[k, k]] = 1e12;
        }
    }
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

/// Logistic regression without random intercepts, from which the search starts, with columns turned so that its effects
/// have no covariance and a standard error of 1.
struct PlainLogit {
    columns: Array2<f64>,
    effects: Array1<f64>,
    /// Turned effects to effects of the design.
    to_effects: Array2<f64>,
}

impl PlainLogit {
    fn fit(successes: &Array1<f64>, design: &Array2<f64>) -> Result<Self, StatisticsError> {
        let n = design.ncols();
        let scale: Array1<f64> =
            design.columns().into_iter().map(|column| (column.dot(&column) / column.len() as f64).sqrt()).collect();
        if scale.iter().any(|v| *v == 0.0) {
            return Err(StatisticsError::Dependent { what: "covariates" });
        }
        let scaled = design / &scale;
        if !is_positive(&scaled.t().dot(&scaled)) {
            return Err(StatisticsError::Dependent { what: "covariates" });
        }
        let mut effects = Array1::<f64>::zeros(n);
        for _ in 0..MOST_NEWTON {
            let shares = scaled.dot(&effects).mapv(logistic);
            let slope = scaled.t().dot(&(&shares - successes));
            let step = cholesky::solve(information(&scaled, &shares), slope.insert_axis(Axis(1))).remove_axis(Axis(1));
            effects -= &step;
            if effects.iter().any(|v| v.is_nan() || v.abs() > 1e6)
                || scaled.dot(&effects).iter().any(|v| v.abs() > SEPARATED)
            {
                return Err(StatisticsError::Separated);
            }
            if step.iter().all(|v| v.abs() < 1e-9) {
                let shares = scaled.dot(&effects).mapv(logistic);
                let lower = factor(&information(&scaled, &shares));
                // Columns times the transposed inverse of the factor.
                let turn = cholesky_inverse(&lower).reversed_axes();
                let unscaled = &turn / &scale.view().insert_axis(Axis(1));
                return Ok(Self { columns: scaled.dot(&turn), effects: lower.t().dot(&effects), to_effects: unscaled });
            }
        }
        Err(StatisticsError::Separated)
    }
}

/// Most Newton steps of the plain regression.
const MOST_NEWTON: usize = 100;

fn information(design: &Array2<f64>, shares: &Array1<f64>) -> Array2<f64> {
    let weights = shares.mapv(|p| p * (1.0 - p)).insert_axis(Axis(1));
    design.t().dot(&(design * &weights))
}

/// Lower Cholesky factor.
fn factor(matrix: &Array2<f64>) -> Array2<f64> {
    let n = matrix.nrows();
    let mut lower = Array2::<f64>::zeros((n, n));
    for i in 0..n {
        for j in 0..=i {
            let rest = matrix[[i, j]] - (0..j).map(|k| lower[[i, k]] * lower[[j, k]]).sum::<f64>();
            lower[[i, j]] = if i == j { rest.max(1e-300).sqrt() } else { rest / lower[[j, j]] };
        }
    }
    lower
}

/// Inverse of a lower triangle.
fn cholesky_inverse(lower: &Array2<f64>) -> Array2<f64> {
    let n = lower.nrows();
    let mut inverse = Array2::<f64>::eye(n);
    for i in 0..n {
        for k in 0..i {
            let above = inverse.row(k).to_owned();
            inverse.row_mut(i).scaled_add(-lower[[i, k]], &above);
        }
        inverse.row_mut(i).mapv_inplace(|v| v / lower[[i, i]]);
    }
    inverse
}
