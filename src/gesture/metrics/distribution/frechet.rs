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

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array3, s};

    /// Signal of the reference script: rows [n, d] that vary together, `kind` a or b.
    fn rows(n: usize, d: usize, kind: usize) -> Array2<f64> {
        let hash = |i: usize, j: usize| ((i * 7919 + j * 104_729 + kind * 611_953) % 1009) as f64 / 1009.0 - 0.5;
        Array2::from_shape_fn((n, d), |(i, j)| {
            10.0 * hash(i, j) + 20.0 * hash(i, j % 5 + 1000) + (kind * j) as f64 * 0.05
        })
    }

    #[test]
    fn the_distance_matches_scipy() {
        let golden: serde_json::Value =
            serde_json::from_str(include_str!("../../../../fixtures/reference/metrics_golden.json")).unwrap();
        for case in golden["frechet"].as_array().unwrap() {
            let number = |name: &str| case[name].as_f64().unwrap();
            let [n_a, n_b, d] = ["n_a", "n_b", "d"].map(|name| number(name) as usize);
            let (a, b) = (GaussianFit::fit(rows(n_a, d, 0).view()), GaussianFit::fit(rows(n_b, d, 1).view()));
            let expected = number("distance");
            for found in [frechet(&a, &b), frechet(&b, &a)] {
                assert!((found - expected).abs() < 1e-6 * expected, "{case}: {found}");
            }
        }
    }

    #[test]
    fn a_set_has_no_distance_from_itself_and_parts_add_up() {
        let all = rows(200, 30, 1);
        let whole = GaussianFit::fit(all.view());
        assert!(frechet(&whole, &whole) < 1e-5);
        let mut parts = GaussianFit::fit(all.slice(s![..1, ..]));
        parts += &GaussianFit::fit(all.slice(s![1..1, ..]));
        parts += &GaussianFit::fit(all.slice(s![1..77, ..]));
        parts += &GaussianFit::fit(all.slice(s![77.., ..]));
        assert_eq!(parts.n, 200);
        let near = |a: &Array2<f64>, b: &Array2<f64>| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(near(&parts.covariance(), &whole.covariance()));
        assert!((&parts.mean - &whole.mean).iter().all(|v| v.abs() < 1e-12));
        assert!(frechet(&whole, &GaussianFit::fit(all.slice(s![..0, ..]))).is_nan());
    }

    #[test]
    fn only_completely_visible_poses_count() {
        let joints = Array3::from_shape_fn((3, N_JOINTS, 3), |(t, joint, k)| (100 * t + joint + k) as f32);
        let mut mask = Array2::from_elem((3, N_JOINTS), true);
        mask[[0, 48]] = false;
        mask[[2, 7]] = false;
        let counted = super::joints([mask.view()]);
        assert_eq!(counted.len(), 46);
        let rows = poses(joints.view(), mask.view(), &counted);
        assert_eq!(rows.shape(), [2, 138]);
        assert_eq!((rows[[0, 0]], rows[[1, 18]], rows[[1, 137]]), (10_100.0, 20_800.0, 25_000.0));
        let mut none = GaussianFit::default();
        none += &GaussianFit::fit(rows.view());
        assert_eq!(none.n, 2);
        assert_eq!(none.mean[0], 15_100.0);
        mask.column_mut(48).fill(false);
        assert_eq!(super::joints([mask.view(), mask.view()]).len(), 45);
        assert!(super::joints([]).is_empty());
    }
}
