//! The first 64 principal components of the corpus' motion windows, computed by orthogonal iteration (Golub and Van
//! Loan, Matrix Computations, 4th edition, 8.2.4).

use super::corpus::{Corpus, CorpusClip};
use anyhow::{Result, ensure};
use candle_core::{Device, Tensor};
use ndarray::{Array1, Array2, Axis, s};
use orator_gesture::metrics::space::basis;
use orator_gesture::metrics::space::basis::{N, WINDOW};
use orator_gesture::metrics::space::fixed_rate::{N_COORDINATES, N_JOINTS_USED, joints_used};
use orator_nn::weights::Contents;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::Path;

/// Frames between the starts of windows.
const STRIDE: usize = 3;
/// Iterations; the span of the 64 directions converges much earlier.
const STEPS: usize = 200;
/// Windows per matrix product.
const ROWS: usize = 2048;

/// Summary of a fitted basis.
pub struct FittedBasis {
    pub n_windows: usize,
    /// Factor applied to the finger coordinates.
    pub finger_weight: f64,
    /// Share of the corpus' variance explained by the 64 directions, 0..1.
    pub share: f64,
    /// Explained share of the variance of each held-out set.
    pub held_out: Vec<(String, f64)>,
}

/// Computes the basis of `corpus` and writes it to `out`.
///
/// # Errors
/// Fewer than 640 windows; the file cannot be written.
pub fn fit(corpus: &Corpus, seed: u64, out: &Path) -> Result<FittedBasis> {
    let weights = weights(&corpus.clips);
    let (n_windows, covariance) = covariance(&corpus.clips, &weights);
    ensure!(
        n_windows > 10 * N,
        "too little motion for a basis of {N} components: expected more than {} windows, found {n_windows}",
        10 * N
    );
    let directions = directions(&covariance, seed);
    let share = |covariance: &Array2<f64>| {
        let held: f64 = directions.columns().into_iter().map(|v| v.dot(&covariance.dot(&v))).sum();
        held / covariance.diag().sum()
    };
    let held_out = corpus.held_out.iter().map(|(set, clips)| {
        let (_, covariance) = self::covariance(clips, &weights);
        (set.clone(), share(&covariance))
    });
    let fitted = FittedBasis {
        n_windows,
        finger_weight: f64::from(*weights.last().unwrap_or(&1.0)),
        share: share(&covariance),
        held_out: held_out.collect(),
    };
    let rows: Vec<f32> = directions.t().iter().map(|v| *v as f32).collect();
    let tensors = BTreeMap::from([
        ("basis".to_owned(), Tensor::from_vec(rows, (N, WINDOW * N_COORDINATES), &Device::Cpu)?),
        ("weights".to_owned(), Tensor::from_vec(weights.to_vec(), N_JOINTS_USED, &Device::Cpu)?),
    ]);
    let facts = json!({ "kind": "motion-basis", "corpus": corpus.metadata(), "seed": seed });
    Contents { facts, tensors }.write(out)?;
    Ok(fitted)
}

/// Weight of each joint: 1 for the arms; for the fingers the factor that gives all of them together the variance of
/// the arms.
fn weights(clips: &[CorpusClip]) -> Array1<f32> {
    let (mut n, mut sum, mut squares) = (0.0, Array1::<f64>::zeros(N_COORDINATES), Array1::<f64>::zeros(N_COORDINATES));
    for clip in clips {
        for pose in basis::poses(clip.joints.view()).outer_iter() {
            let pose = pose.mapv(f64::from);
            n += 1.0;
            squares += &(&pose * &pose);
            sum += &pose;
        }
    }
    let variance = &squares / n - (&sum / n).mapv(|v| v * v);
    let of = |fingers: bool| -> f64 {
        let joints = joints_used().enumerate().filter(|(_, joint)| basis::is_finger(*joint) == fingers);
        joints.map(|(i, _)| variance.slice(s![3 * i..3 * i + 3]).sum()).sum()
    };
    let finger = (of(false) / of(true).max(1e-9)).sqrt() as f32;
    joints_used().map(|joint| if basis::is_finger(joint) { finger } else { 1.0 }).collect()
}

/// Number of windows, and their covariance matrix [2070, 2070].
fn covariance(clips: &[CorpusClip], weights: &Array1<f32>) -> (usize, Array2<f64>) {
    let size = WINDOW * N_COORDINATES;
    let (mut n, mut sum, mut products) = (0, Array1::<f64>::zeros(size), Array2::<f64>::zeros((size, size)));
    let mut rows: Vec<f64> = Vec::new();
    let mut add = |rows: &mut Vec<f64>| {
        let n_rows = rows.len() / size;
        // Rows are complete windows, so the shape always fits.
        let Ok(windows) = Array2::from_shape_vec((n_rows, size), std::mem::take(rows)) else { return };
        n += n_rows;
        sum += &windows.sum_axis(Axis(0));
        ndarray::linalg::general_mat_mul(1.0, &windows.t(), &windows, 1.0, &mut products);
    };
    for clip in clips {
        let poses = basis::poses(clip.joints.view());
        for start in (0..(poses.nrows() + 1).saturating_sub(WINDOW)).step_by(STRIDE) {
            let window = poses.slice(s![start..start + WINDOW, ..]);
            rows.extend(window.indexed_iter().map(|((_, i), v)| f64::from(v * weights[i / 3])));
            if rows.len() >= ROWS * size {
                add(&mut rows);
            }
        }
    }
    add(&mut rows);
    let n_windows = n as f64;
    let mean = (&sum / n_windows.max(1.0)).insert_axis(Axis(1));
    (n, products / n_windows.max(1.0) - mean.dot(&mean.t()))
}

/// The directions [2070, 64] of greatest variance in descending order; the largest component of each is positive.
fn directions(covariance: &Array2<f64>, seed: u64) -> Array2<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut found = Array2::from_shape_simple_fn((covariance.nrows(), N), || rng.random_range(-1.0..1.0));
    for _ in 0..STEPS {
        found = covariance.dot(&found);
        orthonormal(&mut found);
    }
    for mut direction in found.columns_mut() {
        let largest = direction.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(1.0);
        direction *= largest.signum();
    }
    found
}

/// Gram-Schmidt orthonormalisation of the columns, applied twice against rounding errors.
fn orthonormal(columns: &mut Array2<f64>) {
    for i in 0..columns.ncols() {
        for _ in 0..2 {
            let (before, mut rest) = columns.view_mut().split_at(Axis(1), i);
            let mut own = rest.column_mut(0);
            for column in before.columns() {
                let along = column.dot(&own);
                own.scaled_add(-along, &column);
            }
            let length = own.dot(&own).sqrt().max(1e-300);
            own /= length;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_those_of_most_variance() {
        // The variance decreases along known directions.
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut known = Array2::from_shape_simple_fn((100, 100), || rng.random_range(-1.0..1.0));
        orthonormal(&mut known);
        let variances = Array1::from_shape_fn(100, |i| 0.8f64.powi(i as i32));
        let covariance = (&known * &variances).dot(&known.t());
        let found = directions(&covariance, 1);
        for i in 0..60 {
            assert!((found.column(i).dot(&known.column(i)).abs() - 1.0).abs() < 1e-6, "{i}");
        }
    }
}
