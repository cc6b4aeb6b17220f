//! The numbers the generator and the discriminator see: 48 joints (all but the neck) x 3, each coordinate with mean 0
//! and deviation 1 over the training split; and the way back to joints in metres.

use crate::types::pose3d::Motion;
use crate::types::skeleton::{L_HAND, L_WRIST, N_BONES, N_JOINTS, NECK, R_HAND, R_WRIST, is_duplicate};
use anyhow::ensure;
use ndarray::{Array2, Array3, ArrayView2};
use serde::{Deserialize, Serialize};

/// Numbers of a pose. Number `3 * (joint - 1) + k` is coordinate k of a joint.
pub const N_FEATURES: usize = 3 * N_BONES;
/// Least deviation a coordinate is divided by, metres: what hardly moves is not blown up.
const LEAST_STD: f32 = 0.01;

/// Mean and deviation of every number, metres, and the speaker's bone lengths.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Normalisation {
    pub mean: Vec<f32>,
    pub std: Vec<f32>,
    /// Bone of joint `n + 1` to its parent, metres; 0 where it was never measured.
    pub bone_lengths: Vec<f32>,
}

impl Normalisation {
    /// From the statistics of a dataset, [49, 3] each.
    pub fn new(mean: &Array2<f32>, std: &Array2<f32>, bone_lengths: Vec<f32>) -> Self {
        let features = |table: &Array2<f32>| table.iter().skip(3).copied().collect::<Vec<f32>>();
        let std = features(std).into_iter().map(|v| v.max(LEAST_STD)).collect();
        Self { mean: features(mean), std, bone_lengths }
    }

    /// Errors unless the tables have the lengths they should.
    pub fn check(&self) -> anyhow::Result<()> {
        let lengths = [self.mean.len(), self.std.len(), self.bone_lengths.len()];
        ensure!(lengths == [N_FEATURES, N_FEATURES, N_BONES], "its normalisation has {lengths:?} numbers");
        let mut metres = self.mean.iter().chain(&self.std).chain(&self.bone_lengths);
        ensure!(metres.all(|v| v.abs() <= 100.0), "its normalisation has numbers beyond 100 m");
        Ok(())
    }

    /// Motion [T, 49, 3] to numbers [144, T], and which joints but the neck to learn from [48, T]: those that are seen,
    /// without the hand roots. A number that is missing is 0.
    pub fn features(&self, motion: &Motion) -> (Array2<f32>, Array2<bool>) {
        let n_frames = motion.n_frames();
        let mut features = Array2::zeros((N_FEATURES, n_frames));
        let mut mask = Array2::from_elem((N_BONES, n_frames), false);
        for (joint, t) in (1..N_JOINTS).flat_map(|joint| (0..n_frames).map(move |t| (joint, t))) {
            let value = |k: usize| {
                let i = 3 * (joint - 1) + k;
                (motion.joints[[t, joint, k]] - self.mean[i]) / self.std[i]
            };
            let values = [value(0), value(1), value(2)];
            if values.iter().all(|v| v.is_finite()) {
                (0..3).for_each(|k| features[[3 * (joint - 1) + k, t]] = values[k]);
                mask[[joint - 1, t]] = motion.mask[[t, joint]] && !is_duplicate(joint);
            }
        }
        (features, mask)
    }

    /// Numbers [144, T] to joints [T, 49, 3] in metres: the neck at 0, the hand roots at the wrists.
    pub fn joints(&self, features: ArrayView2<f32>) -> Array3<f32> {
        Array3::from_shape_fn((features.ncols(), N_JOINTS, 3), |(t, joint, k)| {
            let joint = match joint {
                NECK => return 0.0,
                L_HAND => L_WRIST,
                R_HAND => R_WRIST,
                other => other,
            };
            let i = 3 * (joint - 1) + k;
            features[[i, t]] * self.std[i] + self.mean[i]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::types::time::FrameRate;

    #[test]
    fn there_and_back() {
        let value = |t: usize, joint: usize, k: usize| (t + 3 * joint + 7 * k) as f32 * 0.01;
        let mut joints = Array3::from_shape_fn((5, N_JOINTS, 3), |(t, joint, k)| value(t, joint, k));
        for t in 0..5 {
            for k in 0..3 {
                joints[[t, NECK, k]] = 0.0;
                joints[[t, L_HAND, k]] = joints[[t, L_WRIST, k]];
                joints[[t, R_HAND, k]] = joints[[t, R_WRIST, k]];
            }
        }
        let whole = joints.clone();
        joints[[2, 5, 1]] = f32::NAN;
        let mut motion = Motion::from_joints(FrameRate::new(15, 1), joints);
        motion.mask[[3, 9]] = false;
        let table = |value| Array2::from_elem((N_JOINTS, 3), value);
        let normal = Normalisation::new(&table(0.1), &table(0.0), vec![0.0; N_BONES]);
        normal.check().unwrap();
        let (features, mask) = normal.features(&motion);
        assert_eq!((features[[12, 2]], features[[13, 2]]), (0.0, 0.0));
        assert_eq!((mask[[4, 2]], mask[[8, 3]], mask[[8, 2]], mask[[L_HAND - 1, 0]]), (false, false, true, false));
        let back = normal.joints(features.view());
        for ((t, joint, k), expected) in whole.indexed_iter() {
            if (t, joint) != (2, 5) {
                assert!((back[[t, joint, k]] - expected).abs() < 1e-5);
            }
        }
    }
}
