//! Laplace approximation of the likelihood of a mixed logistic regression (Breslow and Clayton 1993; Bates et al.
//! 2015). The mode of the standardised random intercepts is found by penalised iteratively reweighted least squares;
//! the determinant of the Hessian at the mode gives the correction.

use crate::stats::cluster::votes::{CLIP, PARTICIPANT, VoteGroups};

/// Maximum number of iterations for the random intercepts.
const MAX_ITERATIONS: usize = 50;

/// Vote with its outcome, 1 or 0, and its levels of the larger and the smaller of the two factors.
struct Observation {
    success: f64,
    many: usize,
    few: usize,
}

/// Likelihood as a function of the fixed intercept and the standard deviations. Each call starts from the random
/// intercepts of the previous one.
pub(super) struct Laplace {
    /// Votes sorted by `many`.
    observations: Vec<Observation>,
    n_many: usize,
    n_few: usize,
    clips_are_many: bool,
    intercepts: Vec<f64>,
}

/// Block decomposition of the Hessian: the diagonal of the larger factor, the Cholesky factor of the Schur complement
/// of the smaller one, and the off-diagonal elements in the order of the observations.
struct Curvature {
    diagonal: Vec<f64>,
    lower: Vec<f64>,
    between: Vec<f64>,
}

impl Laplace {
    pub(super) fn new(groups: &VoteGroups, successes: &[f64]) -> Self {
        let clips_are_many = groups.n[CLIP] > groups.n[PARTICIPANT];
        let (many, few) = if clips_are_many { (CLIP, PARTICIPANT) } else { (PARTICIPANT, CLIP) };
        let mut order: Vec<usize> = (0..successes.len()).collect();
        order.sort_by_key(|vote| groups.of[many][*vote]);
        let observation = |vote: &usize| Observation {
            success: successes[*vote],
            many: groups.of[many][*vote],
            few: groups.of[few][*vote],
        };
        let (n_many, n_few) = (groups.n[many], groups.n[few]);
        Self {
            observations: order.iter().map(observation).collect(),
            n_many,
            n_few,
            clips_are_many,
            intercepts: vec![0.0; n_many + n_few],
        }
    }

    /// Negative log-likelihood for the intercept `fixed` (log odds) and the standard deviations of participants and
    /// clips. An even function of both standard deviations.
    pub(super) fn negative_log_likelihood(&mut self, fixed: f64, [participants, clips]: [f64; 2]) -> f64 {
        let sds = if self.clips_are_many { [clips, participants] } else { [participants, clips] };
        let mut value = self.penalised(&self.intercepts, fixed, sds);
        if !value.is_finite() {
            self.intercepts.fill(0.0);
            value = self.penalised(&self.intercepts, fixed, sds);
        }
        for _ in 0..MAX_ITERATIONS {
            let (gradient, curvature) = self.derivatives(fixed, sds);
            let step = self.solve(&curvature, gradient);
            let size = step.iter().fold(0.0f64, |max, v| max.max(v.abs()));
            let mut share = 1.0;
            let (next, next_value) = loop {
                let next: Vec<f64> = self.intercepts.iter().zip(&step).map(|(u, v)| u - share * v).collect();
                let next_value = self.penalised(&next, fixed, sds);
                if next_value <= value + 1e-9 || share < 1e-6 {
                    break (next, next_value);
                }
                share *= 0.5;
            };
            (self.intercepts, value) = (next, next_value);
            if size < 1e-8 {
                break;
            }
        }
        let (_, curvature) = self.derivatives(fixed, sds);
        let n = self.n_few;
        let determinant = curvature.diagonal.iter().map(|v| 0.5 * v.ln()).sum::<f64>()
            + (0..n).map(|k| curvature.lower[k * n + k].ln()).sum::<f64>();
        value + determinant
    }

    fn penalised(&self, intercepts: &[f64], fixed: f64, sds: [f64; 2]) -> f64 {
        let of_vote = |&Observation { success, many, few }: &Observation| {
            let eta = fixed + sds[0] * intercepts[many] + sds[1] * intercepts[self.n_many + few];
            eta.max(0.0) + (-eta.abs()).exp().ln_1p() - success * eta
        };
        self.observations.iter().map(of_vote).sum::<f64>() + 0.5 * intercepts.iter().map(|u| u * u).sum::<f64>()
    }

    fn derivatives(&self, fixed: f64, sds: [f64; 2]) -> (Vec<f64>, Curvature) {
        let n = self.n_few;
        let mut gradient = self.intercepts.clone();
        let mut diagonal = vec![1.0; self.n_many];
        let mut lower = vec![0.0; n * n];
        (0..n).for_each(|k| lower[k * n + k] = 1.0);
        let mut between = Vec::with_capacity(self.observations.len());
        for &Observation { success, many, few } in &self.observations {
            let eta = fixed + sds[0] * self.intercepts[many] + sds[1] * self.intercepts[self.n_many + few];
            let share = 1.0 / (1.0 + (-eta).exp());
            let weight = share * (1.0 - share);
            let residual = share - success;
            gradient[many] += sds[0] * residual;
            gradient[self.n_many + few] += sds[1] * residual;
            diagonal[many] += sds[0] * sds[0] * weight;
            lower[few * n + few] += sds[1] * sds[1] * weight;
            between.push(sds[0] * sds[1] * weight);
        }
        let mut start = 0;
        for group in self.observations.chunk_by(|a, b| a.many == b.many) {
            let pivot = diagonal[group[0].many];
            for (i, one) in group.iter().enumerate() {
                let factor = between[start + i] / pivot;
                for (j, other) in group.iter().enumerate() {
                    if other.few <= one.few {
                        lower[one.few * n + other.few] -= factor * between[start + j];
                    }
                }
            }
            start += group.len();
        }
        decompose(&mut lower, n);
        (gradient, Curvature { diagonal, lower, between })
    }

    /// Solves curvature x = `right`.
    fn solve(&self, curvature: &Curvature, mut right: Vec<f64>) -> Vec<f64> {
        for (observation, between) in self.observations.iter().zip(&curvature.between) {
            right[self.n_many + observation.few] -=
                between * right[observation.many] / curvature.diagonal[observation.many];
        }
        substitute(&curvature.lower, self.n_few, &mut right[self.n_many..]);
        for (observation, between) in self.observations.iter().zip(&curvature.between) {
            right[observation.many] -= between * right[self.n_many + observation.few];
        }
        right.iter_mut().zip(&curvature.diagonal).for_each(|(v, pivot)| *v /= pivot);
        right
    }
}

/// Replaces the lower triangle of a positive definite matrix [n, n] by its Cholesky factor. Pivots that are too small
/// because of rounding are raised.
fn decompose(lower: &mut [f64], n: usize) {
    for i in 0..n {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| lower[i * n + k] * lower[j * n + k]).sum();
            let rest = lower[i * n + j] - dot;
            lower[i * n + j] = if i == j { rest.max(1e-12).sqrt() } else { rest / lower[j * n + j] };
        }
    }
}

/// Solves L L' x = b in place.
fn substitute(lower: &[f64], n: usize, b: &mut [f64]) {
    for i in 0..n {
        let dot: f64 = (0..i).map(|k| lower[i * n + k] * b[k]).sum();
        b[i] = (b[i] - dot) / lower[i * n + i];
    }
    for i in (0..n).rev() {
        let dot: f64 = (i + 1..n).map(|k| lower[k * n + i] * b[k]).sum();
        b[i] = (b[i] - dot) / lower[i * n + i];
    }
}
