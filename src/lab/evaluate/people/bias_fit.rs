//! Steady part of 2D errors as weights of vectors of the picture, by least squares, and the spread of what is left.

use ndarray::Array2;
use orator_base::math::cholesky;
use orator_base::math::order::median;

/// Median absolute deviation to standard deviation of a normal distribution.
const MAD: f64 = 1.4826;
/// Standard deviations from which on an error is a stray.
pub const STRAY: f64 = 4.0;
/// Penalty of the weights, as a share of the data's, which keeps those of unused vectors at 0.
const PENALTY: f64 = 1e-3;

/// Weights with which `N` vectors explain errors best; each round leaves out what the weights of the round before miss by
/// more than its entry of `most`. `errors` gives error and vectors of every point anew.
pub fn weights<const N: usize, I: Iterator<Item = ([f64; 2], [[f64; 2]; N])>>(
    most: &[f64],
    errors: impl Fn() -> I,
) -> [f64; N] {
    let mut weights = [0.0; N];
    for &most in most {
        let (mut a, mut b, mut n) = (Array2::zeros((N, N)), Array2::zeros((N, 1)), 0.0);
        for (error, basis) in errors() {
            let off = rest(error, &basis, &weights);
            if off[0].hypot(off[1]) > most {
                continue;
            }
            n += 1.0;
            for k in 0..2 {
                for i in 0..N {
                    (0..N).for_each(|j| a[[i, j]] += basis[i][k] * basis[j][k]);
                    b[[i, 0]] += basis[i][k] * error[k];
                }
            }
        }
        (0..N).for_each(|i| a[[i, i]] += PENALTY * n + 1e-9);
        let solved = cholesky::solve(a, b);
        weights = std::array::from_fn(|i| solved[[i, 0]]);
    }
    weights
}

/// Part of an error that the weighted vectors leave.
pub fn rest<const N: usize>(error: [f64; 2], basis: &[[f64; 2]; N], weights: &[f64; N]) -> [f64; 2] {
    [0, 1].map(|k| error[k] - basis.iter().zip(weights).map(|(vector, weight)| weight * vector[k]).sum::<f64>())
}

/// Robust standard deviation about 0.
pub fn deviation(values: &[f64]) -> f64 {
    MAD * median(values.iter().map(|v| v.abs())).unwrap_or(0.0)
}
