//! Solution of linear equations with a symmetric positive definite matrix by Cholesky decomposition.

use ndarray::{Array1, Array2};

/// Solves A X = B for X with a symmetric positive definite A [n, n] and B [n, m]. Pivots below 1e-12 are raised to it,
/// so that the solution is finite, though large, for a singular A.
pub fn solve(mut a: Array2<f64>, mut b: Array2<f64>) -> Array2<f64> {
    let n = a.nrows();
    for j in 0..n {
        for k in 0..j {
            let factor = a[[j, k]];
            for i in j..n {
                a[[i, j]] -= a[[i, k]] * factor;
            }
        }
        let root = a[[j, j]].max(1e-12).sqrt();
        (j..n).for_each(|i| a[[i, j]] /= root);
    }
    let mut at = |i: usize, others: std::ops::Range<usize>, weight: &dyn Fn(usize) -> f64, root: f64| {
        let mut row: Array1<f64> = b.row(i).to_owned();
        others.for_each(|k| row.scaled_add(-weight(k), &b.row(k)));
        b.row_mut(i).assign(&(row / root));
    };
    (0..n).for_each(|i| at(i, 0..i, &|k| a[[i, k]], a[[i, i]]));
    (0..n).rev().for_each(|i| at(i, i + 1..n, &|k| a[[k, i]], a[[i, i]]));
    b
}
