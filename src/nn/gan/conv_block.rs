//! The brick of generator and discriminator: convolution (padding "same", with bias), batch norm (eps 1e-3), leaky
//! ReLU 0.2; over time, or over time and frequency. Channels come last.

use crate::nn::ops::batch_norm::BatchNorm;
use crate::nn::ops::conv_norm::conv_norm;
use crate::nn::ops::conv2d;
use crate::nn::params::{Init, Params};
use candle_core::{Result, Tensor};

const EPS: f64 = 1e-3;
/// Weight of a new batch in the running statistics, where nothing else is said.
const MOMENTUM: f64 = 0.1;
/// Slope of the leaky ReLU.
pub const SLOPE: f64 = 0.2;

/// `<name>.conv.weight` [O, C, K...], `<name>.conv.bias` [O] and the norm `<name>.norm`.
struct Layer {
    weight: Tensor,
    bias: Tensor,
    norm: BatchNorm,
    stride: usize,
}

impl Layer {
    fn new(params: &mut Params, name: &str, shape: &[usize], stride: usize) -> Result<Self> {
        Ok(Self {
            weight: params.trainable(&format!("{name}.conv.weight"), shape, Init::Glorot)?,
            bias: params.trainable(&format!("{name}.conv.bias"), &shape[..1], Init::Constant(0.0))?,
            norm: BatchNorm::new(params, &format!("{name}.norm"), shape[0], EPS, MOMENTUM, SLOPE)?,
            stride,
        })
    }

    fn forward(&self, x: &Tensor, train: bool) -> Result<Tensor> {
        let sizes = conv2d::same(x, &self.weight, self.stride)?;
        conv_norm(x, &self.weight, &self.bias, &self.norm, sizes, train)
    }
}

/// Over time: [B, T, C] to [B, ceil(T / stride), C'].
pub struct Block1d(Layer);

impl Block1d {
    /// Kernel 3, stride 1.
    pub fn plain(params: &mut Params, name: &str, n_in: usize, n_out: usize) -> Result<Self> {
        Self::new(params, name, n_in, n_out, 3, 1)
    }

    /// Kernel 4, stride 2.
    pub fn down(params: &mut Params, name: &str, n_in: usize, n_out: usize) -> Result<Self> {
        Self::new(params, name, n_in, n_out, 4, 2)
    }

    pub fn new(
        params: &mut Params,
        name: &str,
        n_in: usize,
        n_out: usize,
        kernel: usize,
        stride: usize,
    ) -> Result<Self> {
        Ok(Self(Layer::new(params, name, &[n_out, n_in, kernel], stride)?))
    }

    /// With this weight of a new batch in the running statistics.
    pub fn with_momentum(mut self, momentum: f64) -> Self {
        self.0.norm.set_momentum(momentum);
        self
    }

    pub fn forward(&self, x: &Tensor, train: bool) -> Result<Tensor> {
        self.0.forward(x, train)
    }
}

/// Over time and frequency: [B, T, F, C] to [B, T', F', C'].
pub struct Block2d {
    layer: Layer,
    /// The kernel covers all frequencies and is not padded.
    across: bool,
}

impl Block2d {
    /// Kernel 3 x 3, stride 1.
    pub fn plain(params: &mut Params, name: &str, n_in: usize, n_out: usize) -> Result<Self> {
        Ok(Self { layer: Layer::new(params, name, &[n_out, n_in, 3, 3], 1)?, across: false })
    }

    /// Kernel 4 x 4, stride 2.
    pub fn down(params: &mut Params, name: &str, n_in: usize, n_out: usize) -> Result<Self> {
        Ok(Self { layer: Layer::new(params, name, &[n_out, n_in, 4, 4], 2)?, across: false })
    }

    /// Weight of this shape [C', C, K, F] without padding, stride 1, over all F frequencies of its input.
    pub fn across(params: &mut Params, name: &str, shape: [usize; 4]) -> Result<Self> {
        Ok(Self { layer: Layer::new(params, name, &shape, 1)?, across: true })
    }

    /// With this weight of a new batch in the running statistics.
    pub fn with_momentum(mut self, momentum: f64) -> Self {
        self.layer.norm.set_momentum(momentum);
        self
    }

    pub fn forward(&self, x: &Tensor, train: bool) -> Result<Tensor> {
        if !self.across {
            return self.layer.forward(x, train);
        }
        // A frequency's channels are channels too: what is left is a convolution over time.
        let Layer { weight, bias, norm, .. } = &self.layer;
        let ((batch, time, frequencies, channels), (n_out, _, kernel, _)) = (x.dims4()?, weight.dims4()?);
        let x = x.contiguous()?.reshape((batch, time, frequencies * channels))?;
        let weight = weight.permute((0, 3, 1, 2))?.contiguous()?.reshape((n_out, (), kernel))?;
        conv_norm(&x, &weight, bias, norm, conv2d::valid(&x, &weight)?, train)?.unsqueeze(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nn::ops::gradcheck::{pattern, worst};
    use candle_core::DType;

    #[test]
    fn gradients_are_right_in_two_dimensions() -> Result<()> {
        let mut params = Params::with_dtype(3, DType::F64);
        let plain = Block2d::plain(&mut params, "plain", 2, 3)?;
        let down = Block2d::down(&mut params, "down", 3, 2)?;
        let across = Block2d::across(&mut params, "across", [2, 2, 3, 4])?;
        let x = pattern(&[2, 9, 8, 2], 0.0)?;
        let y = down.forward(&plain.forward(&x, false)?, false)?;
        assert_eq!(y.dims(), [2, 5, 4, 2]);
        assert_eq!(across.forward(&y, false)?.dims(), [2, 3, 1, 2]);
        let all = |v: &[Tensor]| across.forward(&down.forward(&plain.forward(&v[0], false)?, false)?, false);
        assert!(worst(&[x], all)? < 1e-7);
        Ok(())
    }
}
