//! Motion representations of the generator output, and their conversion to joints: joint positions (Rebol et al. 2021),
//! or bone directions, which forward kinematics turns into joints with the speaker's bone lengths. Forward kinematics
//! is implemented on tensors for training, and on arrays for generation.

use super::normalisation::{N_FEATURES, Normalisation};
use anyhow::{bail, ensure};
use candle_core::{DType, Device, Result, Tensor};
use ndarray::{Array2, Array3, ArrayView2};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{N_BONES, N_JOINTS, NECK, is_duplicate, parent};
use orator_nn::gpu::launch::is_on_device;
use orator_nn::gpu::poses;
use serde::{Deserialize, Serialize};

/// Smallest standard deviation of a direction coordinate, so that bones that hardly turn are not amplified.
const MIN_STD: f64 = 0.05;
/// Added to the squared length of a direction, because the derivative of the square root is infinite at 0.
const EPS: f64 = 1e-12;

/// Meaning of the 144 joint features of a pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Representation {
    /// Normalised positions of all joints but the neck: mean 0, standard deviation 1.
    Positions,
    /// Feature `3 * bone + k` times `std` plus `mean` is coordinate k of the bone's direction, a vector of any length.
    Bones { mean: Vec<f32>, std: Vec<f32> },
}

impl Representation {
    /// `Bones`, with mean and standard deviation of the unit directions in these poses (from
    /// [`Normalisation::features`]) over the frames in which both ends of the bone are visible.
    pub fn bones(
        normal: &Normalisation,
        poses: impl Iterator<Item = anyhow::Result<(Array2<f32>, Array2<bool>)>>,
    ) -> anyhow::Result<Self> {
        let (mut n, mut sum, mut squares) = ([0.0f64; N_BONES], [0.0f64; N_FEATURES], [0.0f64; N_FEATURES]);
        for pose in poses {
            let (features, mask) = pose?;
            let joints = normal.joints(features.view());
            for (t, joints) in joints.outer_iter().enumerate() {
                let is_visible = |joint: usize| joint == NECK || mask[[joint - 1, t]];
                for joint in (1..N_JOINTS).filter(|joint| !is_duplicate(*joint) && is_visible(*joint)) {
                    let from = real_parent(joint);
                    let bone: [f64; 3] = std::array::from_fn(|k| f64::from(joints[[joint, k]] - joints[[from, k]]));
                    let length = bone.iter().map(|v| v * v).sum::<f64>().sqrt();
                    if !is_visible(from) || length < 1e-6 {
                        continue;
                    }
                    n[joint - 1] += 1.0;
                    for (k, v) in bone.into_iter().enumerate() {
                        sum[3 * (joint - 1) + k] += v / length;
                        squares[3 * (joint - 1) + k] += (v / length).powi(2);
                    }
                }
            }
        }
        let of = |i: usize| match n[i / 3] {
            // A bone that was never visible gets an arbitrary direction: the y axis.
            0.0 => (f64::from(u8::from(i % 3 == 1)), MIN_STD),
            n => (sum[i] / n, (squares[i] / n - (sum[i] / n).powi(2)).max(0.0).sqrt().max(MIN_STD)),
        };
        let (mean, std) = (0..N_FEATURES).map(of).map(|(mean, std)| (mean as f32, std as f32)).unzip();
        Ok(Self::Bones { mean, std })
    }

    pub fn name(&self) -> &'static str {
        match self {
            Self::Positions => "positions",
            Self::Bones { .. } => "bones",
        }
    }

    /// Whether bone lengths are constant for any network output.
    pub fn keeps_lengths(&self) -> bool {
        matches!(self, Self::Bones { .. })
    }

    /// Fails unless the tables have the expected lengths and finite values.
    pub fn check(&self) -> anyhow::Result<()> {
        if let Self::Bones { mean, std } = self {
            let lengths = [mean.len(), std.len()];
            ensure!(
                lengths == [N_FEATURES; 2],
                "invalid bone directions: mean and std have {lengths:?} values, expected {N_FEATURES}"
            );
            if mean.iter().chain(std).any(|v| !v.is_finite()) {
                bail!("invalid bone directions: a value is not finite");
            }
            ensure!(std.iter().all(|v| *v >= 0.0), "invalid bone directions: expected standard deviations >= 0");
        }
        Ok(())
    }

    /// Converts raw features [144, T] to joints [T, 49, 3] in metres, with the neck at 0 and the hand roots at the
    /// wrists. `Bones` gives every bone its length of `normal` in every frame.
    pub fn joints(&self, raw: ArrayView2<f32>, normal: &Normalisation) -> Array3<f32> {
        let Self::Bones { mean, std } = self else { return normal.joints(raw) };
        let mut joints = Array3::<f32>::zeros((raw.ncols(), N_JOINTS, 3));
        for (t, mut joints) in joints.outer_iter_mut().enumerate() {
            for joint in 1..N_JOINTS {
                let direction: [f64; 3] = std::array::from_fn(|k| {
                    let i = 3 * (joint - 1) + k;
                    f64::from(raw[[i, t]]) * f64::from(std[i]) + f64::from(mean[i])
                });
                let length = f64::from(bone_length(joint, normal));
                let scale = length / (direction.iter().map(|v| v * v).sum::<f64>() + EPS).sqrt();
                let from = real_parent(joint);
                for k in 0..3 {
                    joints[[joint, k]] = joints[[from, k]] + (direction[k] * scale) as f32;
                }
            }
        }
        joints
    }

    /// Bone directions of motion as raw features [T, 144], and a mask of the known ones, with both ends of the bone
    /// visible. Unknown features are 0; those of the hand roots are 0 and known. For `Positions` all are unknown.
    pub fn directions(&self, motion: &Motion) -> (Array2<f32>, Array2<bool>) {
        let shape = (motion.n_frames(), N_FEATURES);
        let (mut features, mut known) = (Array2::zeros(shape), Array2::from_elem(shape, false));
        let Self::Bones { mean, std } = self else { return (features, known) };
        for (t, joint) in (0..motion.n_frames()).flat_map(|t| (1..N_JOINTS).map(move |joint| (t, joint))) {
            let columns = 3 * (joint - 1)..3 * joint;
            let from = real_parent(joint);
            let bone: [f32; 3] = std::array::from_fn(|k| motion.joints[[t, joint, k]] - motion.joints[[t, from, k]]);
            let length = bone.iter().map(|v| v * v).sum::<f32>().sqrt();
            let is_known = motion.mask[[t, joint]] && motion.mask[[t, from]] && length.is_finite() && length > 1e-6;
            for (k, i) in columns.enumerate() {
                known[[t, i]] = is_known || is_duplicate(joint);
                if is_known && !is_duplicate(joint) {
                    features[[t, i]] = (bone[k] / length - mean[i]) / std[i];
                }
            }
        }
        (features, known)
    }

    /// Differentiable conversion from raw features to normalised positions.
    pub fn decoder(&self, normal: &Normalisation, dtype: DType, device: &Device) -> Result<PoseDecoder> {
        let Self::Bones { mean, std } = self else { return Ok(PoseDecoder { kinematics: None }) };
        let table = |values: Vec<f64>, shape: &[usize]| Tensor::from_vec(values, shape, device)?.to_dtype(dtype);
        let column = |values: &[f32]| table(values.iter().map(|v| f64::from(*v)).collect(), &[1, N_FEATURES, 1]);
        let lengths: Vec<f64> = (1..N_JOINTS).map(|joint| f64::from(bone_length(joint, normal))).collect();
        // The row of a joint is 1 at every bone on the path from the neck to the joint.
        let mut path = vec![0.0; N_BONES * N_BONES];
        for joint in 1..N_JOINTS {
            let mut at = joint;
            while at != NECK {
                path[(joint - 1) * N_BONES + at - 1] = 1.0;
                at = parent(at).unwrap_or(NECK);
            }
        }
        let parents = (1..N_JOINTS).map(|joint| parent(joint).unwrap_or(NECK) as f64 - 1.0);
        let of_features = [mean, std, &normal.mean, &normal.std].into_iter().flatten();
        let tables = of_features.map(|v| f64::from(*v)).chain(lengths.iter().copied()).chain(parents).collect();
        Ok(PoseDecoder {
            kinematics: Some(Kinematics {
                tables: table(tables, &[14 * N_BONES])?,
                direction_mean: column(mean)?,
                direction_std: column(std)?,
                lengths: table(lengths, &[1, N_BONES, 1, 1])?,
                path: table(path, &[1, N_BONES, N_BONES])?,
                mean: column(&normal.mean)?,
                std: column(&normal.std)?,
            }),
        })
    }
}

/// Parent of a joint without duplicates: fingers start at the wrist, which the hand root duplicates.
pub fn real_parent(joint: usize) -> usize {
    let from = parent(joint).unwrap_or(NECK);
    if is_duplicate(from) { parent(from).unwrap_or(NECK) } else { from }
}

fn bone_length(joint: usize, normal: &Normalisation) -> f32 {
    if is_duplicate(joint) { 0.0 } else { normal.bone_lengths.get(joint - 1).copied().unwrap_or(0.0) }
}

/// Differentiable conversion from raw features to normalised positions.
pub struct PoseDecoder {
    kinematics: Option<Kinematics>,
}

struct Kinematics {
    direction_mean: Tensor,
    direction_std: Tensor,
    /// Bone lengths [1, 48, 1, 1].
    lengths: Tensor,
    /// Bones between the neck and each joint [1, 48, 48], 0 or 1.
    path: Tensor,
    mean: Tensor,
    std: Tensor,
    /// All of these for the kernels of a GPU (`poses::kinematics`).
    tables: Tensor,
}

impl PoseDecoder {
    /// Converts raw features [B, 144 or more, T] to normalised positions; trailing channels are passed through.
    pub fn poses(&self, raw: &Tensor) -> Result<Tensor> {
        let Some(k) = &self.kinematics else { return Ok(raw.clone()) };
        if is_on_device(raw) {
            return poses::kinematics(raw, &k.tables);
        }
        let (batch, n_features, n_frames) = raw.dims3()?;
        if n_features > N_FEATURES {
            let channels = raw.narrow(1, N_FEATURES, n_features - N_FEATURES)?;
            return Tensor::cat(&[self.poses(&raw.narrow(1, 0, N_FEATURES)?)?, channels], 1);
        }
        let directions = raw.broadcast_mul(&k.direction_std)?.broadcast_add(&k.direction_mean)?;
        let directions = directions.reshape((batch, N_BONES, 3, n_frames))?;
        let norms = (directions.sqr()?.sum_keepdim(2)? + EPS)?.sqrt()?;
        let bones = directions.broadcast_div(&norms)?.broadcast_mul(&k.lengths)?;
        let path = k.path.broadcast_as((batch, N_BONES, N_BONES))?.contiguous()?;
        let joints = path.matmul(&bones.reshape((batch, N_BONES, 3 * n_frames))?)?;
        joints.reshape((batch, N_FEATURES, n_frames))?.broadcast_sub(&k.mean)?.broadcast_div(&k.std)
    }
}
