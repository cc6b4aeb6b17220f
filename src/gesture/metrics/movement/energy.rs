//! Motion energy: the mean squared speed of the joints. The ratio of predicted to real energy detects predictions that
//! collapse to the mean pose.

use ndarray::{ArrayView2, ArrayView3};
use orator_base::types::skeleton::{N_JOINTS, NECK, is_duplicate};
use orator_base::types::time::FrameRate;

/// Accumulated squared speeds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotionEnergy {
    /// Sum of squared speeds, (m/s)^2.
    pub sum: f64,
    /// Number of speeds: joints times steps between frames.
    pub n: usize,
}

impl MotionEnergy {
    /// Adds the steps between consecutive frames of `joints` [T, 49, 3] in metres, for all joints but the neck and the
    /// hand roots, where `mask` [T, 49] is true in both frames. The mask of a prediction is that of its ground truth,
    /// so that both are measured on the same joints and frames.
    pub fn add(&mut self, joints: ArrayView3<f32>, mask: ArrayView2<bool>, fps: FrameRate) {
        let per_sec = fps.per_sec();
        for t in 1..joints.shape()[0] {
            for joint in (NECK + 1..N_JOINTS).filter(|joint| !is_duplicate(*joint)) {
                if mask[[t - 1, joint]] && mask[[t, joint]] {
                    let step = |k: usize| f64::from(joints[[t, joint, k]] - joints[[t - 1, joint, k]]) * per_sec;
                    self.sum += (0..3).map(|k| step(k).powi(2)).sum::<f64>();
                    self.n += 1;
                }
            }
        }
    }

    /// Mean squared speed, (m/s)^2; 0 if nothing was added.
    pub fn mean(&self) -> f64 {
        self.sum / self.n.max(1) as f64
    }

    /// Ratio of this energy to that of the ground truth; NaN if the ground truth is static.
    pub fn relative_to(&self, ground_truth: &Self) -> f64 {
        if ground_truth.sum > 0.0 { self.mean() / ground_truth.mean() } else { f64::NAN }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array2, Array3};
    use orator_base::types::skeleton::{L_HAND, R_WRIST};

    #[test]
    fn steady_motion_has_the_square_of_its_speed() {
        // The right wrist moves at 0.3 m/s along x and 0.4 m/s along z. The left hand root, which is not counted,
        // jumps.
        let joints = Array3::from_shape_fn((4, N_JOINTS, 3), |(t, joint, k)| match (joint, k) {
            (R_WRIST, 0) => 0.3 * t as f32 / 15.0,
            (R_WRIST, 2) => 0.4 * t as f32 / 15.0,
            (L_HAND, _) => t as f32,
            _ => 1.0,
        });
        let mut mask = Array2::from_elem((4, N_JOINTS), true);
        let fps = FrameRate::new(15, 1);
        let mut whole = MotionEnergy::default();
        whole.add(joints.view(), mask.view(), fps);
        assert_eq!(whole.n, 3 * 46);
        assert!((whole.mean() - 0.25 / 46.0).abs() < 1e-6);
        mask[[1, R_WRIST]] = false;
        let mut gap = MotionEnergy::default();
        gap.add(joints.view(), mask.view(), fps);
        assert_eq!(gap.n, 3 * 46 - 2);
        assert!((gap.sum - 0.25).abs() < 1e-6);
        assert!((gap.relative_to(&whole) - (0.25 / 136.0) / (0.25 / 46.0)).abs() < 1e-6);
        assert!(whole.relative_to(&MotionEnergy::default()).is_nan());
    }
}
