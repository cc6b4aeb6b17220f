//! Mean and median of many poses, coordinate by coordinate. Values are counted in fine bins, so that memory does not
//! grow with the data and the contribution of a clip can be subtracted again.

use ndarray::{Array2, ArrayView2, ArrayView3};
use orator_base::types::skeleton::N_JOINTS;

const N_COORDINATES: usize = 3 * N_JOINTS;
/// The bins cover coordinates from -`RANGE` to `RANGE`, metres.
const RANGE: f64 = 1.5;
/// Number of bins, 0.25 mm each.
const N_BINS: usize = 12_000;

/// Histograms and sums of all coordinates of poses.
#[derive(Clone)]
pub struct ConstantPoses {
    n: Vec<u64>,
    sum: Vec<f64>,
    /// Counts [147, `N_BINS`].
    bins: Vec<u32>,
}

impl Default for ConstantPoses {
    fn default() -> Self {
        Self { n: vec![0; N_COORDINATES], sum: vec![0.0; N_COORDINATES], bins: vec![0; N_COORDINATES * N_BINS] }
    }
}

impl ConstantPoses {
    /// Adds the joints [T, 49, 3], metres, whose mask [T, 49] is true.
    pub fn add(&mut self, joints: ArrayView3<f32>, mask: ArrayView2<bool>) {
        self.count(joints, mask, true);
    }

    /// Subtracts joints that were added before.
    pub fn subtract(&mut self, joints: ArrayView3<f32>, mask: ArrayView2<bool>) {
        self.count(joints, mask, false);
    }

    fn count(&mut self, joints: ArrayView3<f32>, mask: ArrayView2<bool>, adds: bool) {
        for (frame, seen) in joints.outer_iter().zip(mask.outer_iter()) {
            for (i, value) in frame.iter().enumerate().filter(|(i, value)| seen[i / 3] && value.is_finite()) {
                let value = f64::from(*value);
                let bin = &mut self.bins[i * N_BINS + bin_of(value)];
                if adds {
                    self.n[i] += 1;
                    self.sum[i] += value;
                    *bin += 1;
                } else {
                    self.n[i] = self.n[i].saturating_sub(1);
                    self.sum[i] -= value;
                    *bin = bin.saturating_sub(1);
                }
            }
        }
    }

    /// Mean pose [49, 3], metres; NaN for joints that were never visible.
    pub fn mean(&self) -> Array2<f32> {
        pose(|i| if self.n[i] > 0 { self.sum[i] / self.n[i] as f64 } else { f64::NAN })
    }

    /// Median pose [49, 3], metres, accurate to 0.25 mm; NaN for joints that were never visible.
    pub fn median(&self) -> Array2<f32> {
        // The median of an even count is the mean of the two middle values.
        pose(|i| (self.ranked(i, self.n[i].saturating_sub(1) / 2) + self.ranked(i, self.n[i] / 2)) / 2.0)
    }

    /// Value of rank `rank` of coordinate `i`, assuming an even distribution within its bin.
    fn ranked(&self, i: usize, rank: u64) -> f64 {
        let mut before = 0;
        for (bin, count) in self.bins[i * N_BINS..(i + 1) * N_BINS].iter().enumerate() {
            let count = u64::from(*count);
            if before + count > rank {
                let inside = (rank - before) as f64 + 0.5;
                return (bin as f64 + inside / count as f64) / N_BINS as f64 * 2.0 * RANGE - RANGE;
            }
            before += count;
        }
        f64::NAN
    }
}

fn bin_of(value: f64) -> usize {
    (((value + RANGE) / (2.0 * RANGE) * N_BINS as f64).max(0.0) as usize).min(N_BINS - 1)
}

fn pose(number: impl Fn(usize) -> f64) -> Array2<f32> {
    Array2::from_shape_fn((N_JOINTS, 3), |(joint, k)| number(3 * joint + k) as f32)
}
