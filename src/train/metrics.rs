//! How good made motion is beside the real one: mean absolute error, and the share of correct keypoints.

use crate::types::skeleton::N_JOINTS;
use ndarray::{ArrayView2, ArrayView3};
use serde::{Deserialize, Serialize};

/// A joint is correct within this share of the pose's largest extent (rebol.md section 12).
pub const ALPHA: f32 = 0.2;

/// Correct and counted keypoints.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Correct {
    pub n_correct: usize,
    pub n: usize,
}

impl Correct {
    /// Share of correct keypoints, 0..1.
    pub fn share(&self) -> f64 {
        self.n_correct as f64 / self.n.max(1) as f64
    }

    /// Counts the joints but the neck of every frame, [T, 49, 3] metres, where `mask` [T, 49] is true: correct when
    /// the distance is at most 0.2 of the largest side of the box around the frame's real joints.
    pub fn count(&mut self, made: ArrayView3<f32>, real: ArrayView3<f32>, mask: ArrayView2<bool>) {
        for ((made, real), mask) in made.outer_iter().zip(real.outer_iter()).zip(mask.outer_iter()) {
            let seen: Vec<usize> = (1..N_JOINTS).filter(|joint| mask[*joint]).collect();
            let extent = |k: usize| {
                let values = seen.iter().map(|joint| real[[*joint, k]]);
                let (low, high) =
                    values.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
                high - low
            };
            let radius = ALPHA * (0..3).map(extent).fold(0.0, f32::max);
            for joint in seen {
                let square: f32 = (0..3).map(|k| (made[[joint, k]] - real[[joint, k]]).powi(2)).sum();
                self.n_correct += usize::from(square.sqrt() <= radius);
                self.n += 1;
            }
        }
    }
}

/// A predictor's figures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Mean absolute error of normalised coordinates.
    pub l1: f64,
    /// Share of correct keypoints, 0..1.
    pub pck: f64,
}

/// The generator beside the pose that never moves from the mean, on the same windows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Validation {
    /// The split they were measured on.
    pub split: String,
    pub n_windows: usize,
    pub generator: Figures,
    pub mean_pose: Figures,
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array2, Array3};

    #[test]
    fn the_radius_is_a_fifth_of_the_largest_extent() {
        let mut real = Array3::<f32>::zeros((1, N_JOINTS, 3));
        real[[0, 1, 2]] = 1.0;
        let mut made = real.clone();
        made[[0, 2, 0]] = 0.19;
        made[[0, 3, 0]] = 0.21;
        made[[0, 4, 0]] = 9.0;
        let mut mask = Array2::from_elem((1, N_JOINTS), true);
        mask[[0, 4]] = false;
        let mut correct = Correct::default();
        correct.count(made.view(), real.view(), mask.view());
        assert_eq!(correct, Correct { n_correct: 46, n: 47 });
    }
}
