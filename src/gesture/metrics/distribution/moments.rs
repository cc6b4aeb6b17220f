//! Packed moments, from which mean and covariance of rows are computed: the number of rows, the sums, and the upper
//! triangle of the sums of products. They are additive, as resampling requires.

use ndarray::{Array1, Array2, ArrayView2};

/// Length of the packed moments of rows of length `d`.
pub const fn packed_len(d: usize) -> usize {
    1 + d + d * (d + 1) / 2
}

/// Adds rows [n, d] to packed moments.
pub fn add(rows: ArrayView2<f64>, packed: &mut [f64]) {
    let d = rows.ncols();
    packed[0] += rows.nrows() as f64;
    for row in rows.outer_iter() {
        packed[1..=d].iter_mut().zip(row).for_each(|(sum, v)| *sum += v);
    }
    let products = rows.t().dot(&rows);
    let mut at = 1 + d;
    for i in 0..d {
        for j in i..d {
            packed[at] += products[[i, j]];
            at += 1;
        }
    }
}

/// Number of rows, mean [d] and unbiased covariance [d, d]; `None` for fewer than two rows.
pub fn read(packed: &[f64], d: usize) -> Option<(f64, Array1<f64>, Array2<f64>)> {
    let n = packed[0];
    if n.is_nan() || n < 2.0 {
        return None;
    }
    let mean: Array1<f64> = packed[1..=d].iter().map(|sum| sum / n).collect();
    let mut covariance = Array2::zeros((d, d));
    let mut at = 1 + d;
    for i in 0..d {
        for j in i..d {
            let value = (packed[at] - n * mean[i] * mean[j]) / (n - 1.0);
            covariance[[i, j]] = value;
            covariance[[j, i]] = value;
            at += 1;
        }
    }
    Some((n, mean, covariance))
}
