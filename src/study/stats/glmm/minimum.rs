//! Minimisation of a smooth function of a few parameters with curvature of about 1: BFGS (Broyden, Fletcher, Goldfarb,
//! Shanno 1970) with central differences, and the Hessian at the minimum.

use ndarray::{Array1, Array2};

const MAX_STEPS: usize = 200;
/// Steps of the finite differences for gradients and Hessians.
const GRADIENT_STEP: f64 = 1e-3;
const CURVATURE_STEP: f64 = 0.02;
/// Maximum gradient component at convergence.
const GRADIENT_TOLERANCE: f64 = 1e-4;

/// Result of the search.
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
