//! Convolution of pictures with kernels of 3 x 3, padding "same", channels last: every output place's patch becomes a
//! row, and the layer one matrix product. Own forward and backward for the patches.

use crate::nn::cpu::axis::ConvGeometry;
use crate::nn::cpu::tensor::{Scalar, is_f64, read, slice};
use crate::nn::params::{Init, Params};
use candle_core::backend::BackendStorage;
use candle_core::{CpuStorage, CustomOp1, Layout, Result, Shape, Tensor};

/// `<name>.weight` [O, C, 3, 3] (Glorot uniform) and `<name>.bias` [O] (1e-4).
pub struct Conv3x3 {
    weight: Tensor,
    bias: Tensor,
    stride: usize,
}

impl Conv3x3 {
    pub fn new(params: &mut Params, name: &str, n_in: usize, n_out: usize, stride: usize) -> Result<Self> {
        let weight = params.trainable(&format!("{name}.weight"), &[n_out, n_in, 3, 3], Init::Glorot)?;
        let bias = params.trainable(&format!("{name}.bias"), &[n_out], Init::Constant(1e-4))?;
        Ok(Self { weight, bias, stride })
    }

    /// [B, H, W, C] to [B, ceil(H / stride), ceil(W / stride), O].
    pub fn forward(&self, x: &Tensor) -> Result<Tensor> {
        let (batch, height, width, n_in) = x.dims4()?;
        let n_out = self.bias.dim(0)?;
        let rows = x.contiguous()?.apply_op1(Patches { stride: self.stride })?;
        let weight = self.weight.permute((2, 3, 1, 0))?.contiguous()?.reshape((9 * n_in, n_out))?;
        let y = rows.matmul(&weight)?.broadcast_add(&self.bias)?;
        y.reshape((batch, height.div_ceil(self.stride), width.div_ceil(self.stride), n_out))
    }
}

/// [B, H, W, C] to [B * H' * W', 9 * C]: the 3 x 3 places under each output, row by row, zero outside.
struct Patches {
    stride: usize,
}

/// A picture's sizes: batch, height, width, channels.
type PictureSizes = (usize, usize, usize, usize);

impl Patches {
    /// Calls `each` with (start of a place's channels in the patches, start of them in the pictures).
    fn for_each_offset(&self, (batch, height, width, n_in): PictureSizes, mut each: impl FnMut(usize, usize)) {
        let (down, across) = (ConvGeometry::same(height, 3, self.stride), ConvGeometry::same(width, 3, self.stride));
        let (n_down, n_across) = (height.div_ceil(self.stride), width.div_ceil(self.stride));
        for b in 0..batch {
            for row in 0..n_down {
                for column in 0..n_across {
                    let patch = ((b * n_down + row) * n_across + column) * 9;
                    for kernel_offset in 0..9 {
                        let y = (row * self.stride + kernel_offset / 3).checked_sub(down.pad.0).filter(|y| *y < height);
                        let x =
                            (column * self.stride + kernel_offset % 3).checked_sub(across.pad.0).filter(|x| *x < width);
                        if let (Some(y), Some(x)) = (y, x) {
                            each((patch + kernel_offset) * n_in, ((b * height + y) * width + x) * n_in);
                        }
                    }
                }
            }
        }
    }

    fn n_rows(&self, (batch, height, width, _): PictureSizes) -> usize {
        batch * height.div_ceil(self.stride) * width.div_ceil(self.stride)
    }

    fn gather<T: Scalar>(&self, x: &[T], sizes: PictureSizes) -> Vec<T> {
        let n_in = sizes.3;
        let mut patches = vec![T::zero(); self.n_rows(sizes) * 9 * n_in];
        self.for_each_offset(sizes, |to, from| patches[to..to + n_in].copy_from_slice(&x[from..from + n_in]));
        patches
    }

    /// The transpose of `gather`.
    fn spread<T: Scalar>(&self, patches: &[T], sizes: PictureSizes) -> Vec<T> {
        let (batch, height, width, n_in) = sizes;
        let mut x = vec![T::zero(); batch * height * width * n_in];
        self.for_each_offset(sizes, |from, to| {
            x[to..to + n_in].iter_mut().zip(&patches[from..from + n_in]).for_each(|(x, g)| *x += *g);
        });
        x
    }
}

impl CustomOp1 for Patches {
    fn name(&self) -> &'static str {
        "patches of 3 x 3"
    }

    fn cpu_fwd(&self, x: &CpuStorage, layout: &Layout) -> Result<(CpuStorage, Shape)> {
        let sizes = layout.shape().dims4()?;
        let patches = if is_f64(x.dtype())? {
            CpuStorage::F64(self.gather(slice(x, layout)?, sizes))
        } else {
            CpuStorage::F32(self.gather(slice(x, layout)?, sizes))
        };
        Ok((patches, Shape::from((self.n_rows(sizes), 9 * sizes.3))))
    }

    fn bwd(&self, x: &Tensor, _y: &Tensor, grad: &Tensor) -> Result<Option<Tensor>> {
        let sizes = x.dims4()?;
        Ok(Some(if is_f64(grad.dtype())? {
            let spread = read::<f64, _>(grad, |grad| Ok(self.spread(grad, sizes)))?;
            Tensor::from_vec(spread, x.shape(), x.device())?
        } else {
            let spread = read::<f32, _>(grad, |grad| Ok(self.spread(grad, sizes)))?;
            Tensor::from_vec(spread, x.shape(), x.device())?
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nn::ops::gradcheck::{pattern, worst};
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
