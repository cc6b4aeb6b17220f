//! Least-squares fit of systematic 2D errors as a weighted sum of image vectors, and the deviation of the residuals.

use ndarray::Array2;
use orator_base::math::cholesky;
use orator_base::math::order::median;

/// Factor from median absolute deviation to standard deviation of a normal distribution.
const MAD: f64 = 1.4826;
/// Number of standard deviations above which an error is an outlier.
pub const OUTLIER_STDS: f64 = 4.0;
/// Ridge penalty as a share of the data's scale, which keeps weights of unused vectors at 0.
const PENALTY: f64 = 1e-3;

/// Weights of `N` vectors that best explain the errors. Each round excludes errors whose residual with the previous
/// round's weights exceeds its entry of `max_residuals`. `errors` iterates over error and vectors of every point, once
/// per round.
pub fn weights<const N: usize, I: Iterator<Item = ([f64; 2], [[f64; 2]; N])>>(
    max_residuals: &[f64],
    errors: impl Fn() -> I,
) -> [f64; N] {
    let mut weights = [0.0; N];
    for &max_residual in max_residuals {
        let (mut a, mut b, mut n) = (Array2::zeros((N, N)), Array2::zeros((N, 1)), 0.0);
        for (error, basis) in errors() {
            let off = residual(error, &basis, &weights);
            if off[0].hypot(off[1]) > max_residual {
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

/// Residual of an error after subtracting the weighted vectors.
pub fn residual<const N: usize>(error: [f64; 2], basis: &[[f64; 2]; N], weights: &[f64; N]) -> [f64; 2] {
    [0, 1].map(|k| error[k] - basis.iter().zip(weights).map(|(vector, weight)| weight * vector[k]).sum::<f64>())
}

/// Robust standard deviation about 0.
pub fn deviation(values: &[f64]) -> f64 {
    MAD * median(values.iter().map(|v| v.abs())).unwrap_or(0.0)
}
