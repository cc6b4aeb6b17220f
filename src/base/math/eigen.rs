//! Two decompositions of symmetric matrices for the Frechet distance: a factor of a positive semi-definite matrix, and
//! the eigenvalues (Golub and Van Loan, Matrix Computations, 4th edition, 4.2.8, 8.3.1 and 8.3.3).

use ndarray::{Array1, Array2, Axis, s};

/// Fraction of the largest diagonal element below which a value is a rounding error.
const ROUNDING: f64 = 1e-14;
/// Maximum number of QR steps per eigenvalue; two or three are usual.
const MAX_STEPS: usize = 60;

/// `f` [d, rank] with `f fᵀ` equal to the positive semi-definite `matrix` [d, d], by pivoted Cholesky decomposition.
pub fn factor(matrix: &Array2<f64>) -> Array2<f64> {
    let mut rest = matrix.clone();
    let floor = ROUNDING * rest.diag().iter().fold(0.0, |max: f64, v| max.max(*v));
    let mut columns: Vec<Array1<f64>> = Vec::new();
    while columns.len() < matrix.nrows() {
        let largest = rest.diag().into_iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((pivot, square)) = largest else { break };
        if square <= floor || square.is_nan() {
            break;
        }
        let column = &rest.column(pivot) / square.sqrt();
        for (mut row, scale) in rest.outer_iter_mut().zip(&column) {
            row.scaled_add(-scale, &column);
        }
        columns.push(column);
    }
    let views: Vec<_> = columns.iter().map(|column| column.view().insert_axis(Axis(1))).collect();
    ndarray::concatenate(Axis(1), &views).unwrap_or_else(|_| Array2::zeros((matrix.nrows(), 0)))
}

/// Returns the eigenvalues of a symmetric matrix, unordered.
pub fn eigenvalues(matrix: Array2<f64>) -> Vec<f64> {
    let (mut diagonal, mut off_diagonal) = tridiagonal(matrix);
    let mut high = diagonal.len();
    let mut n_steps = 0;
    while high > 1 {
        let small = |i: usize| off_diagonal[i].abs() <= f64::EPSILON * (diagonal[i].abs() + diagonal[i + 1].abs());
        if small(high - 2) || n_steps == MAX_STEPS {
            high -= 1;
            n_steps = 0;
            continue;
        }
        let low = (0..high - 1).rev().find(|i| small(*i)).map_or(0, |i| i + 1);
        qr_step(&mut diagonal[low..high], &mut off_diagonal[low..high - 1]);
        n_steps += 1;
    }
    diagonal
}

/// Returns the diagonal [n] and the subdiagonal [n - 1] of a tridiagonal matrix with the same eigenvalues, by
/// Householder reflections from both sides, one column at a time.
fn tridiagonal(mut a: Array2<f64>) -> (Vec<f64>, Vec<f64>) {
    let n = a.nrows();
    let mut off_diagonal = Vec::with_capacity(n.saturating_sub(1));
    for k in 0..n.saturating_sub(1) {
        let mut v = a.slice(s![k + 1.., k]).to_owned();
        let norm = -v.dot(&v).sqrt().copysign(v[0]);
        off_diagonal.push(norm);
        v[0] -= norm;
        let square = v.dot(&v);
        if square > 0.0 {
            let mut below = a.slice_mut(s![k + 1.., k + 1..]);
            let p = below.dot(&v) * (2.0 / square);
            let w = &p - &(&v * (p.dot(&v) / square));
            for (i, mut row) in below.outer_iter_mut().enumerate() {
                row.scaled_add(-v[i], &w);
                row.scaled_add(-w[i], &v);
            }
        }
    }
    (a.diag().to_vec(), off_diagonal)
}

/// Applies one implicit QR step with Wilkinson's shift to a tridiagonal matrix of at least 2 rows.
fn qr_step(d: &mut [f64], e: &mut [f64]) {
    let n = d.len();
    let half = (d[n - 2] - d[n - 1]) / 2.0;
    let last = e[n - 2];
    let shift = d[n - 1] - last * last / (half + half.hypot(last).copysign(half));
    let (mut x, mut z) = (d[0] - shift, e[0]);
    for k in 0..n - 1 {
        let r = x.hypot(z);
        let (c, s) = if r > 0.0 { (x / r, z / r) } else { (1.0, 0.0) };
        if k > 0 {
            e[k - 1] = r;
        }
        let (p, q, b) = (d[k], d[k + 1], e[k]);
        d[k] = c * c * p + 2.0 * c * s * b + s * s * q;
        d[k + 1] = s * s * p - 2.0 * c * s * b + c * c * q;
        e[k] = c * s * (q - p) + (c * c - s * s) * b;
        if k + 1 < n - 1 {
            x = e[k];
            z = s * e[k + 1];
            e[k + 1] *= c;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hash(i: usize, j: usize) -> f64 {
        ((i * 7919 + j * 104_729 + 13) % 1009) as f64 / 1009.0 - 0.5
    }

    #[test]
    fn eigenvalues_of_a_known_matrix() {
        // The tridiagonal matrix of 2 and -1 has the eigenvalues 2 - 2 cos(k pi / (n + 1)).
        let n = 30;
        let chain = Array2::from_shape_fn((n, n), |(i, j)| match i.abs_diff(j) {
            0 => 2.0,
            1 => -1.0,
            _ => 0.0,
        });
        // A reflection makes the matrix dense.
        let v = Array1::from_shape_fn(n, |i| hash(i, 3));
        let square = v.dot(&v);
        let turn = Array2::from_shape_fn((n, n), |(i, j)| f64::from(u8::from(i == j)) - 2.0 * v[i] * v[j] / square);
        let mut found = eigenvalues(turn.dot(&chain).dot(&turn));
        found.sort_by(f64::total_cmp);
        for (k, value) in found.iter().enumerate() {
            let known = 2.0 - 2.0 * (std::f64::consts::PI * (k + 1) as f64 / (n + 1) as f64).cos();
            assert!((value - known).abs() < 1e-12, "{k}: {value} {known}");
        }
    }

    #[test]
    fn degenerate_matrices_terminate() {
        assert!(eigenvalues(Array2::zeros((0, 0))).is_empty());
        assert_eq!(eigenvalues(Array2::zeros((5, 5))), vec![0.0; 5]);
        assert_eq!(eigenvalues(Array2::from_elem((1, 1), 3.0)), vec![3.0]);
        let mut one = eigenvalues(Array2::from_elem((4, 4), 1.0));
        one.sort_by(f64::total_cmp);
        assert!((one[3] - 4.0).abs() < 1e-12 && one[2].abs() < 1e-12);
        assert_eq!(eigenvalues(Array2::from_elem((3, 3), f64::NAN)).len(), 3);
        assert_eq!(factor(&Array2::from_elem((3, 3), f64::NAN)).shape(), [3, 0]);
    }

    #[test]
    fn the_factor_has_the_rank_and_reproduces_the_matrix() {
        let rows = Array2::from_shape_fn((7, 20), |(i, j)| hash(i, j));
        let matrix = rows.t().dot(&rows);
        let f = factor(&matrix);
        assert_eq!(f.shape(), [20, 7]);
        let back = f.dot(&f.t());
        assert!(back.iter().zip(&matrix).all(|(a, b)| (a - b).abs() < 1e-12));
    }
}
