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
