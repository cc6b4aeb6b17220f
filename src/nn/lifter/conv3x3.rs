//! 2D convolution with 3 x 3 kernels, padding "same", channels last: the input patch of every output pixel becomes a
//! row, and the layer one matrix product.

use crate::cpu::axis::ConvAxis;
use crate::params::{Init, Params};
use candle_core::{Result, Tensor};

/// `<name>.weight` [O, C, 3, 3] (Glorot uniform) and `<name>.bias` [O] (1e-4).
pub struct Conv3x3 {
    weight: Tensor,
    bias: Tensor,
    stride: usize,
}

impl Conv3x3 {
    pub fn new(params: &mut Params, name: &str, n_in: usize, n_out: usize, stride: usize) -> Result<Self> {
        let (weight, bias) = params.layer(name, &[n_out, n_in, 3, 3], Init::Glorot, Init::Constant(1e-4))?;
        Ok(Self { weight, bias, stride })
    }

    /// [B, H, W, C] to [B, ceil(H / stride), ceil(W / stride), O].
    pub fn forward(&self, x: &Tensor) -> Result<Tensor> {
        let (batch, height, width, n_in) = x.dims4()?;
        let n_out = self.bias.dim(0)?;
        let [down, across] = [height, width].map(|n| ConvAxis::same(n, 3, self.stride));
        let input_indices = Tensor::new(input_indices(batch, down, across), x.device())?;
        let patches =
            x.reshape((batch * height * width, n_in))?.index_select(&input_indices, 0)?.reshape(((), 9 * n_in))?;
        let weight = self.weight.permute((2, 3, 1, 0))?.contiguous()?.reshape((9 * n_in, n_out))?;
        patches.matmul(&weight)?.broadcast_add(&self.bias)?.reshape((batch, down.n_out, across.n_out, n_out))
    }
}

/// Indices of the 3 x 3 input pixels of each output pixel, row by row; `u32::MAX`, which selects zeros, outside the
/// image.
fn input_indices(batch: usize, down: ConvAxis, across: ConvAxis) -> Vec<u32> {
    let at = |axis: ConvAxis, out: usize, offset: usize| {
        (out * axis.stride + offset).checked_sub(axis.pad).filter(|at| *at < axis.n_in)
    };
    let mut input_indices = Vec::with_capacity(batch * down.n_out * across.n_out * 9);
    for (b, row) in (0..batch).flat_map(|b| (0..down.n_out).map(move |row| (b, row))) {
        for (column, offset) in (0..across.n_out).flat_map(|column| (0..9).map(move |offset| (column, offset))) {
            let (y, x) = (at(down, row, offset / 3), at(across, column, offset % 3));
            let index = y.zip(x).map(|(y, x)| ((b * down.n_in + y) * across.n_in + x) as u32);
            input_indices.push(index.unwrap_or(u32::MAX));
        }
    }
    input_indices
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::gradcheck::{pattern, worst};
    use candle_core::DType;

    #[test]
    fn gradients_are_right_at_even_and_odd_sizes() -> Result<()> {
        for (height, width, stride) in [(4, 5, 1), (4, 6, 2), (5, 3, 2)] {
            let inputs = [pattern(&[2, height, width, 2], 1.0)?, pattern(&[3, 2, 3, 3], 2.0)?, pattern(&[3], 3.0)?];
            let error =
                worst(&inputs, |v| Conv3x3 { weight: v[1].clone(), bias: v[2].clone(), stride }.forward(&v[0]))?;
            assert!(error < 1e-7, "{height} x {width}, stride {stride}: {error}");
        }
        Ok(())
    }

    #[test]
    fn stride_two_pads_at_the_end_only() -> Result<()> {
        let mut params = Params::with_dtype(0, DType::F64);
        let conv = Conv3x3::new(&mut params, "c", 1, 1, 2)?;
        let x = pattern(&[1, 4, 4, 1], 0.0)?;
        let y = conv.forward(&x)?.flatten_all()?.to_vec1::<f64>()?;
        let (x, w) = (x.flatten_all()?.to_vec1::<f64>()?, conv.weight.flatten_all()?.to_vec1::<f64>()?);
        let first: f64 = (0..9).map(|k| w[k] * x[k / 3 * 4 + k % 3]).sum();
        assert!((y[0] - first - 1e-4).abs() < 1e-12 && y.len() == 4);
        Ok(())
    }
}
