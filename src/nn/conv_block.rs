//! The brick of generator and discriminator: convolution (padding "same", with bias), batch norm (eps 1e-3), leaky
//! ReLU 0.2; over time, or over time and frequency.

use super::batch_norm::BatchNorm;
use super::conv1d::{Conv1d, Walk};
use super::params::{Init, Params};
use candle_core::{Result, Tensor};

const EPS: f64 = 1e-3;
/// Weight of a new batch in the running statistics, where nothing else is said.
const MOMENTUM: f64 = 0.1;
/// Slope of the leaky ReLU.
pub const SLOPE: f64 = 0.2;

/// Over time: [B, C, T] to [B, C', ceil(T / stride)].
pub struct Block1d {
    conv: Conv1d,
    norm: BatchNorm,
}

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
        Ok(Self {
            conv: Conv1d::new(params, &format!("{name}.conv"), n_in, n_out, kernel)?.with_stride(stride),
            norm: BatchNorm::new(params, &format!("{name}.norm"), n_out, EPS, MOMENTUM, SLOPE)?,
        })
    }

    /// With this weight of a new batch in the running statistics.
    pub fn with_momentum(mut self, momentum: f64) -> Self {
        self.norm.set_momentum(momentum);
        self
    }

    pub fn forward(&self, x: &Tensor, train: bool) -> Result<Tensor> {
        self.norm.forward(&self.conv.forward(x)?, train)
    }
}

/// Over time and frequency: [B, C, T, F] to [B, C', T', F'].
pub struct Block2d {
    weight: Tensor,
    bias: Tensor,
    norm: BatchNorm,
    stride: usize,
    same: bool,
}

impl Block2d {
    /// Kernel 3 x 3, stride 1.
    pub fn plain(params: &mut Params, name: &str, n_in: usize, n_out: usize) -> Result<Self> {
        Self::new(params, name, [n_out, n_in, 3, 3], 1, true)
    }

    /// Kernel 4 x 4, stride 2.
    pub fn down(params: &mut Params, name: &str, n_in: usize, n_out: usize) -> Result<Self> {
        Self::new(params, name, [n_out, n_in, 4, 4], 2, true)
    }

    /// Without padding, stride 1.
    pub fn valid(params: &mut Params, name: &str, shape: [usize; 4]) -> Result<Self> {
        Self::new(params, name, shape, 1, false)
    }

    fn new(params: &mut Params, name: &str, shape: [usize; 4], stride: usize, same: bool) -> Result<Self> {
        Ok(Self {
            weight: params.trainable(&format!("{name}.conv.weight"), &shape, Init::Glorot)?,
            bias: params.trainable(&format!("{name}.conv.bias"), &shape[..1], Init::Constant(0.0))?,
            norm: BatchNorm::new(params, &format!("{name}.norm"), shape[0], EPS, MOMENTUM, SLOPE)?,
            stride,
            same,
        })
    }

    /// With this weight of a new batch in the running statistics.
    pub fn with_momentum(mut self, momentum: f64) -> Self {
        self.norm.set_momentum(momentum);
        self
    }

    pub fn forward(&self, x: &Tensor, train: bool) -> Result<Tensor> {
        let (_, _, height, width) = self.weight.dims4()?;
        let mut x = x.clone();
        if self.same {
            // Padded by hand to the frame, the framework's convolution has no slack, which its backward cannot do.
            for (dim, kernel) in [(2, height), (3, width)] {
                let (before, after) = Walk::same(x.dim(dim)?, kernel, self.stride).pad;
                x = x.pad_with_zeros(dim, before, after)?;
            }
        }
        let y = x.contiguous()?.conv2d(&self.weight, 0, self.stride, 1, 1)?;
        self.norm.forward(&y.broadcast_add(&self.bias.reshape((1, (), 1, 1))?)?, train)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nn::finite_difference::{pattern, worst};
    use candle_core::DType;

    #[test]
    fn gradients_are_right_in_two_dimensions() -> Result<()> {
        let mut params = Params::with_dtype(3, DType::F64);
        let plain = Block2d::plain(&mut params, "plain", 2, 3)?;
        let down = Block2d::down(&mut params, "down", 3, 2)?;
        let across = Block2d::valid(&mut params, "across", [2, 2, 3, 4])?;
        let x = pattern(&[2, 2, 9, 8], 0.0)?;
        let y = down.forward(&plain.forward(&x, false)?, false)?;
        assert_eq!(y.dims(), [2, 2, 5, 4]);
        assert_eq!(across.forward(&y, false)?.dims(), [2, 2, 3, 1]);
        let all = |v: &[Tensor]| across.forward(&down.forward(&plain.forward(&v[0], false)?, false)?, false);
        assert!(worst(&[x], all)? < 1e-7);
        Ok(())
    }
}
