//! Frechet distance between two sets of poses, each modelled as a normal distribution (Dowson and Landau 1982; on raw
//! poses as in the GENEA evaluation, without a trained network). It compares the poses and their covariance, not their
//! order. Few poses bias it upwards, so that sets of different sizes are not comparable. The validation of training
//! uses 138 coordinates per pose, without the hand roots, and `frechet_pose` of the catalogue (`frechet_metrics`) all
//! 144; the two are not comparable.

use ndarray::{Array1, Array2, ArrayView2, ArrayView3, Axis};
use orator_base::math::eigen;
use orator_base::types::skeleton::{N_JOINTS, NECK, is_duplicate};
use std::ops::AddAssign;

const CM: f64 = 100.0;

/// Normal distribution fitted to a set of rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GaussianFit {
    /// Number of rows.
    pub n: usize,
    pub mean: Array1<f64>,
    /// Scatter matrix: sum over the rows of the outer products of their deviations from the mean.
    scatter: Array2<f64>,
}

/// Joints by which poses are compared: those that are visible in at least half of the frames of all `masks` [T, 49],
/// except the neck and the hand roots. A dataset without finger tips is compared without them.
pub fn joints<'a>(masks: impl IntoIterator<Item = ArrayView2<'a, bool>>) -> Vec<usize> {
    let (mut n_visible, mut n_frames) = ([0; N_JOINTS], 0);
    for mask in masks {
        n_frames += mask.nrows();
        for frame in mask.outer_iter() {
            n_visible.iter_mut().zip(frame).for_each(|(n, visible)| *n += usize::from(*visible));
        }
    }
    (NECK + 1..N_JOINTS).filter(|joint| !is_duplicate(*joint) && n_visible[*joint] * 2 >= n_frames.max(1)).collect()
}

/// Rows of the coordinates of `joints` in centimetres, for the frames of `motion` [T, 49, 3] (metres) in which `mask`
/// [T, 49] is true for all of them. The mask of a prediction is that of its ground truth.
pub fn poses(motion: ArrayView3<f32>, mask: ArrayView2<bool>, joints: &[usize]) -> Array2<f64> {
    let is_complete = |t: &usize| !joints.is_empty() && joints.iter().all(|joint| mask[[*t, *joint]]);
    let whole: Vec<usize> = (0..mask.nrows()).filter(is_complete).collect();
    Array2::from_shape_fn((whole.len(), 3 * joints.len()), |(row, i)| {
        CM * f64::from(motion[[whole[row], joints[i / 3], i % 3]])
    })
}

impl GaussianFit {
    /// Fits a normal distribution to rows [n, d].
    pub fn fit(rows: ArrayView2<f64>) -> Self {
        let mean = rows.mean_axis(Axis(0)).unwrap_or_else(|| Array1::zeros(rows.ncols()));
        let deviations = &rows - &mean;
        Self { n: rows.nrows(), scatter: deviations.t().dot(&deviations), mean }
    }

    /// Unbiased covariance [d, d]; zero for fewer than two rows.
    pub fn covariance(&self) -> Array2<f64> {
        &self.scatter / self.n.saturating_sub(1).max(1) as f64
    }
}

impl AddAssign<&Self> for GaussianFit {
    /// Fit of the union of both sets (Chan, Golub, LeVeque 1979), whose rows must have the same length.
    fn add_assign(&mut self, other: &Self) {
        if self.n == 0 || other.n == 0 {
            if other.n > 0 {
                self.clone_from(other);
            }
            return;
        }
        let n = (self.n + other.n) as f64;
        let (own, others) = (self.n as f64 / n, other.n as f64 / n);
        let difference = &other.mean - &self.mean;
        self.scatter += &other.scatter;
        let column = difference.view().insert_axis(Axis(1));
        self.scatter.scaled_add(own * others * n, &column.dot(&column.t()));
        self.mean.scaled_add(others, &difference);
        self.n += other.n;
    }
}

/// Frechet distance `|m1 - m2|^2 + tr(C1 + C2 - 2 sqrt(C1 C2))`, at least 0; for poses in square centimetres. NaN if a
/// value is NaN, or a set is empty.
pub fn frechet(a: &GaussianFit, b: &GaussianFit) -> f64 {
    if a.n == 0 || b.n == 0 {
        return f64::NAN;
    }
    between((&a.mean, &a.covariance()), (&b.mean, &b.covariance()))
}

/// Frechet distance of two means and covariances. The trace of the matrix root is the sum of the roots of the
/// eigenvalues of `fᵀ C2 f` with `C1 = f fᵀ`, which are those of `C1 C2`. No matrix is inverted, so singular
/// covariances (fewer rows than dimensions) are supported.
pub fn between(a: (&Array1<f64>, &Array2<f64>), b: (&Array1<f64>, &Array2<f64>)) -> f64 {
    let ((mean_a, of_a), (mean_b, of_b)) = (a, b);
    let difference = mean_a - mean_b;
    let factor = eigen::factor(of_a);
    let eigenvalues = eigen::eigenvalues(factor.t().dot(of_b).dot(&factor));
    // Negative eigenvalues are rounding errors.
    let root: f64 = eigenvalues.iter().map(|value| value.max(0.0).sqrt()).sum();
    let distance = difference.dot(&difference) + of_a.diag().sum() + of_b.diag().sum() - 2.0 * root;
    if distance.is_nan() { distance } else { distance.max(0.0) }
}
