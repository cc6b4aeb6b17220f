//! First canonical correlation of predicted and ground-truth poses over time: the largest correlation between a
//! weighted sum of all predicted coordinates and one of all ground-truth coordinates. With few frames and many
//! coordinates it is near 1 for any motion.

use crate::metrics::definition::{Better, BodyPart, Definition, MetricFamily};
use crate::metrics::distribution::moments;
use crate::metrics::pair::PairedFrames;
use crate::metrics::sums::BlockSums;
use ndarray::{Array2, ArrayView2, s};
use orator_base::math::eigen;
use serde_json::json;

/// Standard deviation, metres, up to which a coordinate counts as constant.
const CONSTANT: f64 = 1e-8;
/// Share of unexplained variance up to which a coordinate counts as determined by the others and is dropped.
const DETERMINED: f64 = 1e-10;

pub(crate) fn metric(part: BodyPart) -> MetricFamily {
    let joints = part.joints();
    let d = 3 * joints.len();
    let definition = Definition {
        formula: "first canonical correlation (one component) of the poses of made and real motion in the same frames, all \
                  intervals together: x, y, z of all joints of the part, frames in which all are seen; coordinates \
                  with a standard deviation of at most 1e-8 m are dropped, and those that the others determine up to \
                  1e-10 of their variance (which changes nothing)",
        undefined: "fewer frames with all joints of the part visible than there are coordinates, or one motion is constant",
        parameters: json!({"n_numbers": d, "n_components": 1}),
        ..Definition::new("cca", part.name(), "1", Better::Higher)
    };
    let measure = move |pair: &PairedFrames, blocks: &mut BlockSums| {
        for (block, frames) in pair.complete_frames(&joints, blocks).iter().enumerate() {
            let rows = Array2::from_shape_fn((frames.len(), 2 * d), |(row, i)| {
                let poses = if i < d { &pair.predicted } else { &pair.ground_truth };
                poses[frames[row]][joints[i % d / 3]][i % 3]
            });
            moments::add(rows.view(), blocks.row(block));
        }
    };
    let values = move |sums: &[f64]| {
        let value = moments::read(sums, 2 * d).filter(|(n, ..)| *n > d as f64);
        vec![value.map_or(f64::NAN, |(_, _, covariance)| correlation(covariance.view(), d))]
    };
    let family = MetricFamily::new(vec![definition], moments::packed_len(2 * d), measure, values);
    MetricFamily { is_costly: true, ..family }
}

/// First canonical correlation of the first `d` dimensions with the others; NaN if nothing varies on one side.
pub fn correlation(covariance: ArrayView2<f64>, d: usize) -> f64 {
    if covariance.iter().any(|v| !v.is_finite()) {
        return f64::NAN;
    }
    let (a, b) = (
        IndependentDimensions::select(covariance, 0..d),
        IndependentDimensions::select(covariance, d..covariance.nrows()),
    );
    if a.which.is_empty() || b.which.is_empty() {
        return f64::NAN;
    }
    let cross = Array2::from_shape_fn((a.which.len(), b.which.len()), |(i, j)| {
        covariance[[a.which[i], b.which[j]]] / (a.scale[i] * b.scale[j])
    });
    // La^-1 C Lb^-T
    let whitened = b.solve(a.solve(cross).reversed_axes());
    let smaller = if a.which.len() < b.which.len() { whitened.t().dot(&whitened) } else { whitened.dot(&whitened.t()) };
    eigen::eigenvalues(smaller).into_iter().fold(0.0, f64::max).sqrt().min(1.0)
}

/// Linearly independent dimensions, with the Cholesky factor of their correlation matrix.
struct IndependentDimensions {
    which: Vec<usize>,
    /// Standard deviation of each.
    scale: Vec<f64>,
    /// Lower triangle [n, n].
    factor: Array2<f64>,
}

impl IndependentDimensions {
    /// Independent dimensions of a range by pivoted Cholesky decomposition, which stops when the others are determined.
    fn select(covariance: ArrayView2<f64>, range: std::ops::Range<usize>) -> Self {
        let mut remaining: Vec<usize> = range.filter(|i| covariance[[*i, *i]].max(0.0).sqrt() > CONSTANT).collect();
        let scale_of = |i: usize| covariance[[i, i]].sqrt();
        let mut rest: Vec<f64> = vec![1.0; remaining.len()];
        let mut rows: Vec<Vec<f64>> = vec![Vec::new(); remaining.len()];
        let (mut which, mut factor) = (Vec::new(), Vec::new());
        while let Some((pivot, largest)) = rest.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1)) {
            if largest <= DETERMINED {
                break;
            }
            let (chosen, mut row) = (remaining.swap_remove(pivot), rows.swap_remove(pivot));
            rest.swap_remove(pivot);
            let root = largest.sqrt();
            for ((own, rest), other) in rows.iter_mut().zip(&mut rest).zip(&remaining) {
                let correlation = covariance[[chosen, *other]] / (scale_of(chosen) * scale_of(*other));
                let entry = (correlation - row.iter().zip(own.iter()).map(|(a, b)| a * b).sum::<f64>()) / root;
                *rest -= entry * entry;
                own.push(entry);
            }
            row.push(root);
            which.push(chosen);
            factor.push(row);
        }
        let n = which.len();
        let lower = Array2::from_shape_fn((n, n), |(i, j)| factor[i].get(j).copied().unwrap_or(0.0));
        Self { scale: which.iter().map(|i| scale_of(*i)).collect(), which, factor: lower }
    }

    /// `factor^-1 right`.
    fn solve(&self, mut right: Array2<f64>) -> Array2<f64> {
        for i in 0..self.which.len() {
            let (done, mut rest) = right.view_mut().split_at(ndarray::Axis(0), i);
            let known = self.factor.slice(s![i, ..i]).dot(&done);
            let mut row = rest.row_mut(0);
            row -= &known;
            row /= self.factor[[i, i]];
        }
        right
    }
}
