//! Encoder of motion windows: convolutions over time to a code of 32 values, after the embedding network of Yoon et
//! al. 2020 (34 frames; kernels 3, 3, 4 with stride 2, 3; then 256, 128, 32), applied to all bones. Every layer has
//! batch norm and leaky ReLU; the code itself is normalised without activation, so that its values have about unit
//! variance over the training data. The decoder for its training is in `orator-lab`.

use super::Mode;
use super::ops::batch_norm::BatchNorm;
use super::ops::conv1d::Conv1d;
use super::params::{Init, Params};
use candle_core::{Device, Module, Result, Tensor, Var};
use candle_nn::Linear;
use ndarray::{Array2, ArrayView2};
use serde::{Deserialize, Serialize};

pub const WINDOW: usize = 34;
pub const N_CODE: usize = 32;
/// Windows that share convolutions start at multiples of this many frames.
pub const STEP: usize = 2;
/// Prefix of the tensor names.
pub const NAME: &str = "encoder.";

/// Number of channels of the last convolution, and below it the number of its positions in a window.
pub const LAST: usize = 32;
const POSITIONS: usize = 12;
/// Negative slope of the leaky ReLUs.
pub const SLOPE: f64 = 0.2;
const MOMENTUM: f64 = 0.1;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// Number of values per frame.
    pub n_in: usize,
    /// Numbers of channels of the first three convolutions.
    pub channels: [usize; 3],
    /// Widths of the two hidden layers before the code.
    pub hidden: [usize; 2],
}

impl Default for Config {
    fn default() -> Self {
        Self { n_in: 138, channels: [96, 64, 64], hidden: [256, 128] }
    }
}

pub struct MotionEncoder {
    /// Mean and standard deviation of each value of a frame, [1, n_in, 1]; the input is (x - mean) / std.
    mean: Var,
    std: Var,
    convs: Vec<(Conv1d, BatchNorm)>,
    dense: Vec<(Linear, BatchNorm)>,
}

/// Creates the batch norm of a layer of `n` channels, with its activation.
pub fn norm(params: &mut Params, name: &str, n: usize, slope: f64) -> Result<BatchNorm> {
    BatchNorm::new(params, &format!("{name}.norm"), n, 1e-5, MOMENTUM, slope)
}

/// Fully connected layers between successive `widths`, with their norms; `last`: the negative slope of the last layer.
pub fn dense(params: &mut Params, prefix: &str, widths: &[usize], last: f64) -> Result<Vec<(Linear, BatchNorm)>> {
    let mut layers = Vec::new();
    for (i, pair) in widths.windows(2).enumerate() {
        let name = format!("{prefix}dense{i}");
        let slope = if i + 2 == widths.len() { last } else { SLOPE };
        layers.push((params.linear(&name, [pair[0], pair[1]], Init::He, 0.0)?, norm(params, &name, pair[1], slope)?));
    }
    Ok(layers)
}

pub fn through<L: Module>(layers: &[(L, BatchNorm)], x: &Tensor, mode: &Mode) -> Result<Tensor> {
    layers.iter().try_fold(x.clone(), |x, (layer, norm)| norm.forward(&layer.forward(&x)?, mode.trains()))
}

impl MotionEncoder {
    /// Creates the network's tensors in `params`.
    pub fn new(params: &mut Params, config: &Config) -> Result<Self> {
        let mean = params.buffer(&format!("{NAME}mean"), &[1, config.n_in, 1], 0.0)?;
        let std = params.buffer(&format!("{NAME}std"), &[1, config.n_in, 1], 1.0)?;
        let [a, b, c] = config.channels;
        let mut convs = Vec::new();
        for (i, (n_in, n_out, kernel, stride)) in
            [(config.n_in, a, 3, 1), (a, b, 3, 1), (b, c, 4, STEP), (c, LAST, 3, 1)].into_iter().enumerate()
        {
            let name = format!("{NAME}conv{i}");
            let conv = Conv1d::valid(params, &name, [n_in, n_out], kernel, stride)?;
            convs.push((conv, norm(params, &name, n_out, SLOPE)?));
        }
        let [d, e] = config.hidden;
        let dense = dense(params, NAME, &[LAST * POSITIONS, d, e, N_CODE], 1.0)?;
        Ok(Self { mean, std, convs, dense })
    }

    /// Sets mean and standard deviation of each value of a frame.
    pub fn set_statistics(&self, mean: &[f32], std: &[f32]) -> Result<()> {
        let set = |var: &Var, values: &[f32]| {
            let values = Tensor::from_slice(values, (1, values.len(), 1), &Device::Cpu)?;
            var.set(&values.to_dtype(var.dtype())?.to_device(var.device())?)
        };
        set(&self.mean, mean)?;
        set(&self.std, std)
    }

    /// Normalises frames [B, n_in, T] for the network.
    pub fn normalised(&self, x: &Tensor) -> Result<Tensor> {
        x.broadcast_sub(&self.mean.as_detached_tensor())?.broadcast_div(&self.std.as_detached_tensor())
    }

    /// Inverts `normalised`.
    pub fn plain(&self, x: &Tensor) -> Result<Tensor> {
        x.broadcast_mul(&self.std.as_detached_tensor())?.broadcast_add(&self.mean.as_detached_tensor())
    }

    /// Encodes normalised windows [B, n_in, 34] to codes [B, 32].
    pub fn forward(&self, x: &Tensor, mode: &Mode) -> Result<Tensor> {
        through(&self.dense, &through(&self.convs, x, mode)?.flatten_from(1)?, mode)
    }

    /// Codes [n, 32] of the windows of `frames` [T, n_in] that start at 0, `stride`, 2 `stride` ...; `stride` is a
    /// multiple of 2. Without padding, neighbouring windows share the convolutions; only dense layers run per window.
    pub fn codes(&self, frames: ArrayView2<f32>, stride: usize) -> Result<Array2<f32>> {
        let (n_frames, n_in) = frames.dim();
        let n = (n_frames + 1).saturating_sub(WINDOW).div_ceil(stride);
        if n == 0 {
            return Ok(Array2::zeros((0, N_CODE)));
        }
        let values: Vec<f32> = frames.t().iter().copied().collect();
        let x = self.normalised(&Tensor::from_vec(values, (1, n_in, n_frames), &Device::Cpu)?)?;
        let y = through(&self.convs, &x, &Mode::Eval)?.squeeze(0)?.to_vec2::<f32>()?;
        let window = |i: usize| y.iter().flat_map(move |row| &row[i * stride / STEP..][..POSITIONS]).copied();
        let windows: Vec<f32> = (0..n).flat_map(window).collect();
        let windows = Tensor::from_vec(windows, (n, LAST * POSITIONS), &Device::Cpu)?;
        let codes = through(&self.dense, &windows, &Mode::Eval)?;
        let codes = codes.flatten_all()?.to_vec1()?;
        Array2::from_shape_vec((n, N_CODE), codes).map_err(candle_core::Error::wrap)
    }

    /// Sets the weight of a new batch in the running statistics.
    pub fn set_momentum(&mut self, momentum: f64) {
        self.convs.iter_mut().for_each(|(_, norm)| norm.set_momentum(momentum));
        self.dense.iter_mut().for_each(|(_, norm)| norm.set_momentum(momentum));
    }
}
