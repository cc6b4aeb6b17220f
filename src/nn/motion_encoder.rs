//! The auto-encoder of motion windows: convolutions over time to a code of 32 numbers, and back, for training. After
//! the embedding network of Yoon et al. 2020 (34 frames; 3, 3, 4 by twos, 3 wide; then 256, 128, 32), on all bones.
//! Every layer has batch norm and leaky ReLU; the code itself is normalised without activation, so that its numbers have
//! about unit variance over what was learnt from.

use super::Mode;
use super::ops::batch_norm::BatchNorm;
use super::ops::conv1d::Conv1d;
use super::ops::linear::Linear;
use super::params::Params;
use candle_core::{Device, Module, Result, Tensor, Var};
use ndarray::{Array2, ArrayView2};
use serde::{Deserialize, Serialize};

/// Frames of a window.
pub const WINDOW: usize = 34;
/// Numbers of a code.
pub const N_CODE: usize = 32;
/// Windows that share convolutions begin a multiple of this apart.
pub const STEP: usize = 2;
/// Prefixes of the two halves' tensors.
pub const NAME: &str = "encoder.";
const DECODER: &str = "decoder.";

/// Channels of the last convolution, and how many places of it a window has.
const LAST: usize = 32;
const PLACES: usize = 12;
const SLOPE: f64 = 0.2;
const MOMENTUM: f64 = 0.1;

/// The network's shape.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// Numbers of a frame.
    pub n_in: usize,
    /// Channels of the first three convolutions.
    pub channels: [usize; 3],
    /// Widths of the two layers before the code.
    pub hidden: [usize; 2],
}

impl Default for Config {
    fn default() -> Self {
        Self { n_in: 138, channels: [96, 64, 64], hidden: [256, 128] }
    }
}

/// Windows to codes.
pub struct MotionEncoder {
    /// Of each number of a frame, [1, n_in, 1]: what is learnt is (x - mean) / std.
    mean: Var,
    std: Var,
    convs: Vec<(Conv1d, BatchNorm)>,
    dense: Vec<(Linear, BatchNorm)>,
}

fn norm(params: &mut Params, name: &str, n: usize, slope: f64) -> Result<BatchNorm> {
    BatchNorm::new(params, &format!("{name}.norm"), n, 1e-5, MOMENTUM, slope)
}

/// Fully connected layers from each of `widths` to the next, with their norms; `last`: slope of the last one.
fn dense(params: &mut Params, prefix: &str, widths: &[usize], last: f64) -> Result<Vec<(Linear, BatchNorm)>> {
    let mut layers = Vec::new();
    for (i, pair) in widths.windows(2).enumerate() {
        let name = format!("{prefix}dense{i}");
        let slope = if i + 2 == widths.len() { last } else { SLOPE };
        layers.push((Linear::new(params, &name, pair[0], pair[1])?, norm(params, &name, pair[1], slope)?));
    }
    Ok(layers)
}

/// Layer and norm, one pair after the other.
fn through<L: Module>(layers: &[(L, BatchNorm)], x: &Tensor, mode: &Mode) -> Result<Tensor> {
    layers.iter().try_fold(x.clone(), |x, (layer, norm)| norm.forward(&layer.forward(&x)?, mode.trains()))
}

impl MotionEncoder {
    /// Makes the network's tensors in `params`.
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
        let dense = dense(params, NAME, &[LAST * PLACES, d, e, N_CODE], 1.0)?;
        Ok(Self { mean, std, convs, dense })
    }

    /// Sets mean and standard deviation of the numbers of a frame.
    pub fn set_statistics(&self, mean: &[f32], std: &[f32]) -> Result<()> {
        let set = |var: &Var, values: &[f32]| {
            let values = Tensor::from_slice(values, (1, values.len(), 1), &Device::Cpu)?;
            var.set(&values.to_dtype(var.dtype())?.to_device(var.device())?)
        };
        set(&self.mean, mean)?;
        set(&self.std, std)
    }

    /// [B, n_in, T] as the network wants it.
    pub fn normalised(&self, x: &Tensor) -> Result<Tensor> {
        x.broadcast_sub(&self.mean.as_detached_tensor())?.broadcast_div(&self.std.as_detached_tensor())
    }

    /// The other way round.
    pub fn plain(&self, x: &Tensor) -> Result<Tensor> {
        x.broadcast_mul(&self.std.as_detached_tensor())?.broadcast_add(&self.mean.as_detached_tensor())
    }

    /// Windows [B, n_in, 34], normalised, to codes [B, 32].
    pub fn forward(&self, x: &Tensor, mode: &Mode) -> Result<Tensor> {
        through(&self.dense, &through(&self.convs, x, mode)?.flatten_from(1)?, mode)
    }

    /// Codes [n, 32] of the windows of `frames` [T, n_in] that begin at 0, `stride`, 2 `stride` ... (a multiple of 2).
    /// No layer is padded, so neighbouring windows share the convolutions; only the dense layers run window by window.
    pub fn codes(&self, frames: ArrayView2<f32>, stride: usize) -> Result<Array2<f32>> {
        let (n_frames, n_in) = frames.dim();
        let n = (n_frames + 1).saturating_sub(WINDOW).div_ceil(stride);
        if n == 0 {
            return Ok(Array2::zeros((0, N_CODE)));
        }
        let values: Vec<f32> = frames.t().iter().copied().collect();
        let x = self.normalised(&Tensor::from_vec(values, (1, n_in, n_frames), &Device::Cpu)?)?;
        let y = through(&self.convs, &x, &Mode::Eval)?.squeeze(0)?.to_vec2::<f32>()?;
        let window = |i: usize| y.iter().flat_map(move |row| &row[i * stride / STEP..][..PLACES]).copied();
        let windows: Vec<f32> = (0..n).flat_map(window).collect();
        let windows = Tensor::from_vec(windows, (n, LAST * PLACES), &Device::Cpu)?;
        let codes = through(&self.dense, &windows, &Mode::Eval)?;
        let codes = codes.flatten_all()?.to_vec1()?;
        Array2::from_shape_vec((n, N_CODE), codes).map_err(candle_core::Error::wrap)
    }

    fn set_momentum(&mut self, momentum: f64) {
        self.convs.iter_mut().for_each(|(_, norm)| norm.set_momentum(momentum));
        self.dense.iter_mut().for_each(|(_, norm)| norm.set_momentum(momentum));
    }
}

/// Encoder and decoder, to train with.
pub struct AutoEncoder {
    pub encoder: MotionEncoder,
    dense: Vec<(Linear, BatchNorm)>,
    /// From the last dense layer's numbers on, which are channels x 34 frames.
    convs: Vec<(Conv1d, BatchNorm)>,
    last: Conv1d,
}

impl AutoEncoder {
    /// Makes both halves' tensors in `params`.
    pub fn new(params: &mut Params, config: &Config) -> Result<Self> {
        let encoder = MotionEncoder::new(params, config)?;
        let dense = dense(params, DECODER, &[N_CODE, 128, LAST * WINDOW], SLOPE)?;
        let mut convs = Vec::new();
        for (i, (n_in, n_out)) in [(LAST, 64), (64, 64)].into_iter().enumerate() {
            let name = format!("{DECODER}conv{i}");
            convs.push((Conv1d::new(params, &name, n_in, n_out, 3)?, norm(params, &name, n_out, SLOPE)?));
        }
        let last = Conv1d::new(params, &format!("{DECODER}last"), 64, config.n_in, 3)?;
        Ok(Self { encoder, dense, convs, last })
    }

    /// Windows [B, n_in, 34], normalised, to what is left of them after the code, the same shape.
    pub fn forward(&self, x: &Tensor, mode: &Mode) -> Result<Tensor> {
        let code = self.encoder.forward(x, mode)?;
        let y = through(&self.dense, &code, mode)?.reshape((x.dim(0)?, LAST, WINDOW))?;
        self.last.forward(&through(&self.convs, &y, mode)?)
    }

    /// How much a batch counts in the running statistics.
    pub fn set_momentum(&mut self, momentum: f64) {
        self.encoder.set_momentum(momentum);
        self.dense.iter_mut().for_each(|(_, norm)| norm.set_momentum(momentum));
        self.convs.iter_mut().for_each(|(_, norm)| norm.set_momentum(momentum));
    }
}
