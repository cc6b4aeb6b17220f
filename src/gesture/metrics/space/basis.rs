//! Windows of 15 poses as 64 coordinates in a fixed orthonormal basis: the principal components of freely available
//! motion capture and of rule-based motion (`models/motion_basis.md`). A row is one matrix product, without a network.
//!
//! A pose is 46 joints in centimetres, arms relative to the neck and fingers relative to their wrist. Fixed weights
//! give the fingers the same variance over the corpus as the arms, else principal components would ignore the hands.

use super::fixed_rate::{Frames, N_COORDINATES, N_JOINTS_USED, joints_used};
use anyhow::{Context, Result, ensure};
use ndarray::{Array1, Array2, ArrayView2, ArrayView3, s};
use orator_base::types::skeleton::{L_HAND, L_WRIST, NECK, R_HAND, R_WRIST};
use orator_base::types::time::FrameRate;
use safetensors::{Dtype, SafeTensors};
use std::sync::LazyLock;

/// Frames per window, 1 s at 15 fps.
pub const WINDOW: usize = 15;
/// Frames between the starts of two windows.
pub const STRIDE: usize = 4;
pub const N: usize = 64;

const FILE: &[u8] = include_bytes!("../../../../models/motion_basis.safetensors");
const CM: f32 = 100.0;
/// Windows per matrix product.
const ROWS: usize = 256;

/// Orthonormal basis of a subspace of windows.
pub struct Basis {
    /// Weight of each used joint.
    pub weights: Array1<f32>,
    /// Basis vectors as columns [window x coordinates, N].
    pub directions: Array2<f32>,
}

static BUILT_IN: LazyLock<Option<Basis>> = LazyLock::new(|| Basis::parse(FILE).ok());

/// Rows [n, 64] in weighted centimetres of the completely visible windows of `joints` [T, 49, 3] in metres with `mask`
/// [T, 49]; the mask of a prediction is that of its ground truth.
pub fn windows(joints: ArrayView3<f32>, mask: ArrayView2<bool>, fps: FrameRate) -> Array2<f64> {
    // A test guarantees that the built-in file is valid.
    BUILT_IN.as_ref().map_or_else(|| Array2::zeros((0, N)), |basis| basis.rows(&Frames::new(joints, mask, fps)))
}

/// Hash of the basis, hexadecimal; values of different bases are not comparable.
pub fn hash() -> String {
    blake3::hash(FILE).to_hex().to_string()
}

impl Basis {
    /// Basis from the bytes of a file of `orator-lab train basis`. Fails if tensors are missing or of another shape.
    pub fn parse(bytes: &[u8]) -> Result<Self> {
        let file = SafeTensors::deserialize(bytes)?;
        let numbers = |name: &str, shape: &[usize]| -> Result<Vec<f32>> {
            let tensor = file.tensor(name).with_context(|| format!("tensor {name} is missing"))?;
            ensure!(
                tensor.shape() == shape && tensor.dtype() == Dtype::F32,
                "tensor {name} is {:?} {:?}, expected F32 {shape:?}",
                tensor.dtype(),
                tensor.shape()
            );
            let bytes = tensor.data().chunks_exact(4);
            Ok(bytes.map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
        };
        let weights = Array1::from_vec(numbers("weights", &[N_JOINTS_USED])?);
        let rows =
            Array2::from_shape_vec((N, WINDOW * N_COORDINATES), numbers("basis", &[N, WINDOW * N_COORDINATES])?)?;
        Ok(Self { weights, directions: rows.reversed_axes().as_standard_layout().into_owned() })
    }

    fn rows(&self, frames: &Frames) -> Array2<f64> {
        let mut poses = poses(frames.joints.view());
        for mut pose in poses.outer_iter_mut() {
            pose.iter_mut().enumerate().for_each(|(i, v)| *v *= self.weights[i / 3]);
        }
        let starts = frames.starts(WINDOW, STRIDE);
        let mut rows = Array2::zeros((starts.len(), N));
        let mut windows = Array2::zeros((ROWS.min(starts.len()), WINDOW * N_COORDINATES));
        for (first, starts) in starts.chunks(ROWS).enumerate() {
            for (&start, mut window) in starts.iter().zip(windows.outer_iter_mut()) {
                let part = poses.slice(s![start..start + WINDOW, ..]);
                window.iter_mut().zip(part).for_each(|(to, from)| *to = *from);
            }
            let product = windows.slice(s![..starts.len(), ..]).dot(&self.directions);
            rows.slice_mut(s![first * ROWS..first * ROWS + starts.len(), ..]).assign(&product.mapv(f64::from));
        }
        rows
    }
}

/// Unweighted poses [T, 138] in cm of joints [T, 49, 3] in metres: arms relative to the neck, fingers to their wrist.
pub fn poses(joints: ArrayView3<f32>) -> Array2<f32> {
    let mut poses = Array2::zeros((joints.shape()[0], N_COORDINATES));
    for (mut pose, frame) in poses.outer_iter_mut().zip(joints.outer_iter()) {
        for (i, joint) in joints_used().enumerate() {
            let from = origin(joint);
            (0..3).for_each(|k| pose[3 * i + k] = CM * (frame[[joint, k]] - frame[[from, k]]));
        }
    }
    poses
}

pub fn is_finger(joint: usize) -> bool {
    joint > L_HAND
}

fn origin(joint: usize) -> usize {
    match joint {
        _ if !is_finger(joint) => NECK,
        _ if joint < R_HAND => L_WRIST,
        _ => R_WRIST,
    }
}
