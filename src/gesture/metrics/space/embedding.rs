//! Embedding of windows of 34 poses in 32 dimensions by a fixed trained encoder (`nn::motion_encoder`,
//! `models/motion_embedding.md`), after Yoon et al. 2020. Its input are bone directions, so the size of a speaker does
//! not matter, and a finger bone has the same weight as an upper arm.

use super::fixed_rate::{FPS, Frames, N_COORDINATES, joints_used};
use anyhow::{Context, Result, ensure};
use candle_core::safetensors::load_buffer;
use candle_core::{Device, Tensor};
use ndarray::{Array2, ArrayView2, ArrayView3, concatenate, s};
use orator_base::types::skeleton::parent;
use orator_base::types::time::FrameRate;
use orator_nn::motion_encoder::{self, Config, MotionEncoder};
use orator_nn::params::Params;
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// Frames per window, 2.3 s at 15 fps.
pub const WINDOW: usize = motion_encoder::WINDOW;
/// Frames between the starts of two windows.
pub const STRIDE: usize = 4;
pub const N: usize = motion_encoder::N_CODE;
pub const KIND: &str = "motion-embedding";

const FILE: &[u8] = include_bytes!("../../../../models/motion_embedding.safetensors");
/// Windows per batch of the network.
const BATCH: usize = 256;

static BUILT_IN: LazyLock<Option<MotionEncoder>> = LazyLock::new(|| parse(FILE).ok());

/// Embeddings [n, 32] of the completely visible windows of `joints` [T, 49, 3] in metres with `mask` [T, 49]; the mask
/// of a prediction is that of its ground truth. Rows are NaN if the encoder fails.
pub fn windows(joints: ArrayView3<f32>, mask: ArrayView2<bool>, fps: FrameRate) -> Array2<f64> {
    // A test guarantees that the built-in file is valid.
    BUILT_IN.as_ref().map_or_else(|| Array2::zeros((0, N)), |encoder| rows(encoder, &Frames::new(joints, mask, fps)))
}

/// Hash of the encoder weights, hexadecimal; values of different encoders are not comparable.
pub fn hash() -> String {
    blake3::hash(FILE).to_hex().to_string()
}

/// Encoder from the bytes of a file of `orator-lab train embedding`.
pub fn parse(bytes: &[u8]) -> Result<MotionEncoder> {
    let (_, header) = safetensors::SafeTensors::read_metadata(bytes)?;
    let facts = header.metadata().as_ref().and_then(|m| m.get("orator")).context("not a file of orator")?;
    let facts: serde_json::Value = serde_json::from_str(facts)?;
    ensure!(facts["kind"] == KIND, "unsupported kind {}: expected {KIND}", facts["kind"]);
    let config: Config =
        serde_json::from_value(facts["lesson"]["config"].clone()).context("invalid network configuration")?;
    ensure!(config == Config::default(), "unsupported network {config:?}: expected {:?}", Config::default());
    let mut params = Params::frozen();
    let encoder = MotionEncoder::new(&mut params, &config)?;
    let tensors = load_buffer(bytes, &Device::Cpu)?;
    let tensors: BTreeMap<String, Tensor> =
        tensors.into_iter().filter(|(name, _)| name.starts_with(motion_encoder::NAME)).collect();
    params.load(&tensors)?;
    Ok(encoder)
}

/// Embeddings [n, 32] of all windows of these frames by this encoder.
pub fn rows(encoder: &MotionEncoder, frames: &Frames) -> Array2<f64> {
    let directions = directions(frames.joints.view());
    let mut parts = Vec::new();
    for range in &frames.complete {
        let n = (range.len() + 1).saturating_sub(WINDOW).div_ceil(STRIDE);
        for first in (0..n).step_by(BATCH) {
            let n = BATCH.min(n - first);
            let start = range.start + first * STRIDE;
            let part = directions.slice(s![start..start + (n - 1) * STRIDE + WINDOW, ..]);
            let codes = encoder.codes(part, STRIDE).unwrap_or_else(|_| Array2::from_elem((n, N), f32::NAN));
            parts.push(codes.mapv(f64::from));
        }
    }
    let views: Vec<_> = parts.iter().map(|part| part.view()).collect();
    concatenate(ndarray::Axis(0), &views).unwrap_or_else(|_| Array2::zeros((0, N)))
}

/// Unit vectors [T, 138] of the bones that end in the joints used; 0 for a bone without length.
pub fn directions(joints: ArrayView3<f32>) -> Array2<f32> {
    let bones: Vec<(usize, usize)> = joints_used().filter_map(|joint| Some((parent(joint)?, joint))).collect();
    let mut directions = Array2::zeros((joints.shape()[0], N_COORDINATES));
    for (mut row, frame) in directions.outer_iter_mut().zip(joints.outer_iter()) {
        for (i, &(from, to)) in bones.iter().enumerate() {
            let bone: [f32; 3] = std::array::from_fn(|k| frame[[to, k]] - frame[[from, k]]);
            let length = bone.iter().map(|v| v * v).sum::<f32>().sqrt().max(1e-6);
            (0..3).for_each(|k| row[3 * i + k] = bone[k] / length);
        }
    }
    directions
}

const _: () = assert!(FPS.num == 15 && FPS.den == 1 && STRIDE.is_multiple_of(motion_encoder::STEP));
