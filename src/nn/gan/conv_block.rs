//! Building block of generator and discriminator: convolution (padding "same", with bias), batch norm (eps 1e-3),
//! leaky ReLU 0.2; over time, or over time and frequency. Channels last.

use crate::ops::batch_norm::BatchNorm;
use crate::ops::conv_norm::conv_norm;
use crate::ops::conv2d;
use crate::params::{Init, Params};
use candle_core::{Result, Tensor};

const EPS: f64 = 1e-3;
/// Default weight of a new batch in the running statistics.
pub const MOMENTUM: f64 = 0.1;
/// Negative slope of the leaky ReLU.
pub const SLOPE: f64 = 0.2;

/// Tensors: `<name>.conv.weight` [O, C, K...], `<name>.conv.bias` [O] and the norm `<name>.norm`.
pub struct ConvBlock {
    weight: Tensor,
    bias: Tensor,
    norm: BatchNorm,
    stride: usize,
    /// Whether the kernel covers all frequencies, without padding.
    full_height: bool,
}

impl ConvBlock {
    /// Creates a block with a weight of this `shape`: [C', C, K] (over time) or [C', C, K, K'] (over time and
    /// frequency). `momentum` is the weight of a new batch in the running statistics.
    pub fn new(params: &mut Params, name: &str, shape: &[usize], stride: usize, momentum: f64) -> Result<Self> {
        let (weight, bias) = params.layer(&format!("{name}.conv"), shape, Init::Glorot, Init::Constant(0.0))?;
        let norm = BatchNorm::new(params, &format!("{name}.norm"), shape[0], EPS, momentum, SLOPE)?;
        Ok(Self { weight, bias, norm, stride, full_height: false })
    }

    /// Creates a block with a weight of this `shape` [C', C, K, F], stride 1 and no padding, over all F frequencies of
    /// its input.
    pub fn full_height(params: &mut Params, name: &str, shape: [usize; 4], momentum: f64) -> Result<Self> {
        Ok(Self { full_height: true, ..Self::new(params, name, &shape, 1, momentum)? })
    }

    /// Maps [B, T, C] to [B, ceil(T / stride), C'], or [B, T, F, C] to [B, T', F', C'].
    pub fn forward(&self, x: &Tensor, train: bool) -> Result<Tensor> {
        let Self { weight, bias, norm, .. } = self;
        if !self.full_height {
            return conv_norm(x, weight, bias, norm, conv2d::same(x, weight, self.stride)?, train);
        }
        // The channels of all frequencies are treated as channels, which leaves a convolution over time.
        let ((batch, time, frequencies, channels), (n_out, _, kernel, _)) = (x.dims4()?, weight.dims4()?);
        let x = x.contiguous()?.reshape((batch, time, frequencies * channels))?;
        let weight = weight.permute((0, 3, 1, 2))?.contiguous()?.reshape((n_out, (), kernel))?;
        conv_norm(&x, &weight, bias, norm, conv2d::valid(&x, &weight)?, train)?.unsqueeze(2)
    }
}
