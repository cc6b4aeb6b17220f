//! The temporal-convolution lifter of VideoPose3D (Pavllo et al. 2019): 3D joints of the middle frame from 2D
//! keypoints over time, in its strided form: windows of exactly one receptive field, without redundant work.

use crate::Mode;
use crate::ops::batch_norm::BatchNorm;
use crate::ops::conv1d::Conv1d;
use crate::ops::dropout::dropout;
use crate::params::Params;
use candle_core::{Device, Module, Result, Tensor};
use serde::{Deserialize, Serialize};

/// Why the network runs on the CPU only; `None` once all of its operators have a formulation for other devices.
pub const CPU_ONLY: Option<&str> =
    Some("the body lifter runs on the CPU only, since conv1d and batch norm have no implementation for CUDA");
/// Initial weight of a new batch in the running statistics; training lowers it with `set_momentum`.
const MOMENTUM: f64 = 0.1;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// Number of inputs per frame, for instance 2 per keypoint.
    pub n_in: usize,
    /// Number of outputs per frame, 3 per joint.
    pub n_out: usize,
    pub channels: usize,
    /// Odd kernel widths; their product is the receptive field.
    pub widths: Vec<usize>,
    pub dropout: f64,
}

impl Config {
    /// Number of input frames of one output frame.
    pub fn receptive_field(&self) -> usize {
        self.widths.iter().product()
    }
}

/// Network: `expand`, one residual block for each further width, `shrink`.
pub struct TemporalLifter {
    config: Config,
    expand: ConvUnit,
    blocks: Vec<ResidualBlock>,
    shrink: Conv1d,
}

/// A convolution over every `width` frames, then one of width 1.
struct ResidualBlock {
    width: usize,
    over_time: ConvUnit,
    mix: ConvUnit,
}

/// Convolution without bias, batch norm, ReLU, dropout.
struct ConvUnit {
    conv: Conv1d,
    norm: BatchNorm,
}

impl ConvUnit {
    fn new(params: &mut Params, name: &str, n: [usize; 2], width: usize) -> Result<Self> {
        Ok(Self {
            conv: Conv1d::valid(params, &format!("{name}.conv"), n, width, width)?,
            norm: BatchNorm::new(params, &format!("{name}.norm"), n[1], 1e-5, MOMENTUM, 0.0)?,
        })
    }

    fn forward(&self, x: &Tensor, p: f64, mode: &mut Mode) -> Result<Tensor> {
        dropout(&self.norm.forward(&self.conv.forward(x)?, mode.trains())?, p, mode)
    }
}

impl TemporalLifter {
    /// Creates the network's tensors under `<name>.`.
    ///
    /// # Errors
    /// A width is even, or there is none.
    pub fn new(params: &mut Params, name: &str, config: &Config) -> Result<Self> {
        let Some((first, others)) = config.widths.split_first() else {
            candle_core::bail!("the temporal lifter has no widths: expected at least one");
        };
        if config.widths.iter().any(|width| width % 2 == 0) {
            candle_core::bail!("invalid widths {:?} of the temporal lifter: expected odd numbers", config.widths);
        }
        let n = config.channels;
        let expand = ConvUnit::new(params, &format!("{name}.expand"), [config.n_in, n], *first)?;
        let mut blocks = Vec::new();
        for (i, &width) in others.iter().enumerate() {
            let over_time = ConvUnit::new(params, &format!("{name}.block{i}.over_time"), [n, n], width)?;
            let mix = ConvUnit::new(params, &format!("{name}.block{i}.mix"), [n, n], 1)?;
            blocks.push(ResidualBlock { width, over_time, mix });
        }
        let shrink = Conv1d::new(params, &format!("{name}.shrink"), n, config.n_out, 1)?;
        Ok(Self { config: config.clone(), expand, blocks, shrink })
    }

    pub fn config(&self) -> &Config {
        &self.config
    }

    pub fn device(&self) -> &Device {
        self.expand.norm.weight.device()
    }

    /// Maps windows of one receptive field [B, n_in, RF] to their middle frames [B, n_out]. The windows are
    /// concatenated to one sequence: the stride of every kernel equals its width, so none extends into the next
    /// window, and all operations run on long rows.
    pub fn forward(&self, x: &Tensor, mode: &mut Mode) -> Result<Tensor> {
        let p = self.config.dropout;
        let (n_windows, n, n_frames) = x.dims3()?;
        let x = x.transpose(0, 1)?.reshape((1, n, n_windows * n_frames))?;
        let mut x = self.expand.forward(&x, p, mode)?;
        for block in &self.blocks {
            let (_, n, n_frames) = x.dims3()?;
            let middle = x.reshape((1, n, n_frames / block.width, block.width))?;
            let middle = middle.narrow(3, block.width / 2, 1)?.squeeze(3)?;
            let y = block.over_time.forward(&x, p, mode)?;
            x = (middle + block.mix.forward(&y, p, mode)?)?;
        }
        self.shrink.forward(&x)?.squeeze(0)?.t()?.contiguous()
    }

    /// Sets the weight of a new batch in the running statistics of every batch norm.
    pub fn set_momentum(&mut self, momentum: f64) {
        self.expand.norm.set_momentum(momentum);
        for block in &mut self.blocks {
            block.over_time.norm.set_momentum(momentum);
            block.mix.norm.set_momentum(momentum);
        }
    }
}
