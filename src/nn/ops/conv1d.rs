//! Convolution over time with its own forward and backward passes (the stock one's weight gradient is wrong for every
//! batch larger than one). All frames of the whole batch become the columns of one matrix, so that a pass is one
//! matrix product; sums run in a fixed order, so results do not depend on the number of threads.

use super::fallback;
use super::operator::{CpuOperator, CustomOperator, Operand};
use crate::nn::cpu::axis::ConvGeometry;
use crate::nn::cpu::tensor::{GRAIN, Matrix, Scalar, matmul, scratch, sum};
use crate::nn::params::{Init, Params};
use candle_core::{Result, Shape, Tensor};
use rayon::prelude::*;

/// Convolves `x` [B, C, T] with `weight` [O, C, K] and adds `bias` [O]: [B, O, T'], T' = `walk.n_out(T, K)`. f32 or
/// f64.
pub fn conv1d(x: &Tensor, weight: &Tensor, bias: &Tensor, geometry: ConvGeometry) -> Result<Tensor> {
    if crate::nn::device::needs_fallback(x) {
        return fallback::conv1d(x, weight, bias, geometry);
    }
    x.contiguous()?.apply_op3(&weight.contiguous()?, &bias.contiguous()?, CustomOperator(Conv1dOp { geometry }))
}

/// A convolution with its weights: `<name>.weight` [O, C, K], Glorot uniform, and `<name>.bias` [O], zero.
pub struct Conv1d {
    weight: Tensor,
    /// Constant zeros for a layer without bias.
    bias: Tensor,
    geometry: ConvGeometry,
}

impl Conv1d {
    /// `n_in` channels to `n_out`, as many frames as come in, with bias; `kernel` is odd.
    pub fn new(params: &mut Params, name: &str, n_in: usize, n_out: usize, kernel: usize) -> Result<Self> {
        let weight = params.trainable(&format!("{name}.weight"), &[n_out, n_in, kernel], Init::Glorot)?;
        let bias = params.trainable(&format!("{name}.bias"), &[n_out], Init::Constant(0.0))?;
        Ok(Self { weight, bias, geometry: ConvGeometry { pad: (kernel / 2, kernel / 2), ..ConvGeometry::VALID } })
    }

    /// `n_in` channels to `n_out`, without bias and padding, every `stride`-th frame of kernels of this dilation.
    pub fn valid(
        params: &mut Params,
        name: &str,
        [n_in, n_out]: [usize; 2],
        kernel: usize,
        stride: usize,
        dilation: usize,
    ) -> Result<Self> {
        let weight = params.trainable(&format!("{name}.weight"), &[n_out, n_in, kernel], Init::Glorot)?;
        let bias = Tensor::zeros(n_out, weight.dtype(), weight.device())?;
        Ok(Self { weight, bias, geometry: ConvGeometry { stride, dilation, pad: (0, 0) } })
    }

    /// The strided form of a dilated layer: the same weights on frames that lie `dilation` apart already, kernels
    /// side by side without overlap, so that a training window of one receptive field costs no wasted work.
    pub fn forward_strided(&self, x: &Tensor) -> Result<Tensor> {
        let (_, _, kernel) = self.weight.dims3()?;
        conv1d(x, &self.weight, &self.bias, ConvGeometry { stride: kernel, ..ConvGeometry::VALID })
    }
}

impl candle_core::Module for Conv1d {
    /// [B, C, T] to [B, O, T'].
    fn forward(&self, x: &Tensor) -> Result<Tensor> {
        conv1d(x, &self.weight, &self.bias, self.geometry)
    }
}

struct Conv1dOp {
    geometry: ConvGeometry,
}

/// All sizes of one pass: `n` columns are the output frames of the whole batch, `depth` rows are (channel, tap).
struct Conv1dSizes {
    batch: usize,
    n_in: usize,
    n_out: usize,
    kernel: usize,
    t_in: usize,
    t_out: usize,
    n: usize,
    depth: usize,
}

impl Conv1dOp {
    fn sizes(&self, x: &[usize], weight: &[usize], n_bias: usize) -> Result<Conv1dSizes> {
        if let (&[batch, n_in, t_in], &[n_out, w_in, kernel]) = (x, weight)
            && n_in == w_in
            && n_bias == n_out
            && n_in * n_out * batch * t_in > 0
            && let Some(t_out) = self.geometry.n_out(t_in, kernel)
        {
            return Ok(Conv1dSizes { batch, n_in, n_out, kernel, t_in, t_out, n: batch * t_out, depth: n_in * kernel });
        }
        candle_core::bail!("conv1d: input {x:?} does not fit weight {weight:?}, bias {n_bias} with {:?}", self.geometry)
    }

    /// Output frames whose tap `k` falls inside the input, and the input frame under the first of them.
    fn inside(&self, k: usize, s: &Conv1dSizes) -> (std::ops::Range<usize>, usize) {
        let ConvGeometry { stride, dilation, pad } = self.geometry;
        let start = pad.0.saturating_sub(k * dilation).div_ceil(stride).min(s.t_out);
        let end = (s.t_in + pad.0).saturating_sub(k * dilation).div_ceil(stride).clamp(start, s.t_out);
        (start..end, (start * stride + k * dilation).saturating_sub(pad.0))
    }

    /// Row (c, k), column (b, t): `x[b, c, t * stride + k * dilation - pad]`, zero outside.
    fn columns<T: Scalar>(&self, columns: &mut [T], x: &[T], s: &Conv1dSizes) {
        let per_channel = s.kernel * s.n;
        columns.par_chunks_mut(per_channel).with_min_len(GRAIN / per_channel).enumerate().for_each(|(c, rows)| {
            for (k, row) in rows.chunks_exact_mut(s.n).enumerate() {
                let (inside, first) = self.inside(k, s);
                for (b, row) in row.chunks_exact_mut(s.t_out).enumerate() {
                    let x = &x[(b * s.n_in + c) * s.t_in..][..s.t_in];
                    row[..inside.start].fill(T::zero());
                    row[inside.end..].fill(T::zero());
                    let row = &mut row[inside.clone()];
                    match self.geometry.stride {
                        1 => row.copy_from_slice(&x[first.min(s.t_in)..][..row.len()]),
                        stride => row.iter_mut().enumerate().for_each(|(t, y)| *y = x[first + t * stride]),
                    }
                }
            }
        });
    }

    /// The transpose of `columns`: every column entry is added to the input frame it came from, taps in order.
    fn uncolumns<T: Scalar>(&self, x: &mut [T], columns: &[T], s: &Conv1dSizes) {
        x.par_chunks_mut(s.t_in).with_min_len(GRAIN / (s.t_in * s.kernel)).enumerate().for_each(|(row, x)| {
            let (b, c) = (row / s.n_in, row % s.n_in);
            for k in 0..s.kernel {
                let (inside, first) = self.inside(k, s);
                let grad = &columns[(c * s.kernel + k) * s.n + b * s.t_out..][..s.t_out][inside];
                match self.geometry.stride {
                    1 => x[first.min(s.t_in)..].iter_mut().zip(grad).for_each(|(x, g)| *x += *g),
                    stride => grad.iter().enumerate().for_each(|(t, g)| x[first + t * stride] += *g),
                }
            }
        });
    }
}

impl CpuOperator for Conv1dOp {
    const NAME: &'static str = "conv1d over time";

    fn forward<T: Scalar>(&self, [x, weight, bias]: [Operand<T>; 3]) -> Result<(Vec<T>, Shape)> {
        let s = &self.sizes(x.dims, weight.dims, bias.values.len())?;
        let mut y = vec![T::zero(); s.n_out * s.n];
        scratch(s.depth * s.n + y.len(), |memory: &mut [T]| {
            let (columns, product) = memory.split_at_mut(s.depth * s.n);
            self.columns(columns, x.values, s);
            matmul(product, Matrix::new(weight.values, s.depth), Matrix::new(columns, s.n), s.n_out, s.n, s.depth);
            y.par_chunks_mut(s.t_out).with_min_len(GRAIN / s.t_out).enumerate().for_each(|(row, y)| {
                let (b, o) = (row / s.n_out, row % s.n_out);
                let product = &product[(o * s.batch + b) * s.t_out..][..s.t_out];
                y.iter_mut().zip(product).for_each(|(y, sum)| *y = *sum + bias.values[o]);
            });
        });
        Ok((y, Shape::from((s.batch, s.n_out, s.t_out))))
    }

    fn backward<T: Scalar>(
        &self,
        [x, weight, bias]: [Operand<T>; 3],
        _: &[T],
        grad: &[T],
    ) -> Result<[Option<Vec<T>>; 3]> {
        let s = &self.sizes(x.dims, weight.dims, bias.values.len())?;
        let zeros = |n| vec![T::zero(); n];
        let mut grad_x = zeros(s.batch * s.n_in * s.t_in);
        let (mut grad_weight, mut grad_bias) = (zeros(s.n_out * s.depth), zeros(s.n_out));
        scratch(s.depth * s.n + grad.len(), |memory: &mut [T]| {
            let (columns, rows) = memory.split_at_mut(s.depth * s.n);
            // Gradient of the batch as one row an output channel.
            rows.par_chunks_mut(s.n).zip(&mut grad_bias).with_min_len(GRAIN / s.n).enumerate().for_each(
                |(o, (row, grad_bias))| {
                    for (b, row) in row.chunks_exact_mut(s.t_out).enumerate() {
                        row.copy_from_slice(&grad[(b * s.n_out + o) * s.t_out..][..s.t_out]);
                    }
                    *grad_bias = T::from_f64(sum(row));
                },
            );
            let rows = Matrix::new(rows, s.n);
            self.columns(columns, x.values, s);
            matmul(&mut grad_weight, rows, Matrix::new(columns, s.n).transposed(), s.n_out, s.depth, s.n);
            matmul(columns, Matrix::new(weight.values, s.depth).transposed(), rows, s.depth, s.n, s.n_out);
            self.uncolumns(&mut grad_x, columns, s);
        });
        Ok([Some(grad_x), Some(grad_weight), Some(grad_bias)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nn::ops::gradcheck::{any_threads_give_the_same, apart, pattern, worst};
    use candle_core::{DType, Var};

    #[test]
    fn it_is_what_the_framework_gives_and_gradients_are_right() -> Result<()> {
        for (batch, n_frames, kernel, stride, dilation, pad) in [
            (2, 9, 1, 1, 1, (0, 0)),
            (3, 11, 3, 1, 1, (1, 1)),
            (2, 13, 4, 2, 1, (1, 2)),
            (2, 12, 4, 2, 1, (1, 1)),
            (3, 12, 3, 2, 1, (0, 0)),
            (2, 8, 4, 1, 1, (1, 2)),
            (2, 9, 3, 3, 1, (0, 0)),
            (3, 11, 3, 3, 1, (0, 0)),
            (2, 11, 3, 1, 3, (0, 0)),
            (2, 21, 3, 1, 9, (0, 0)),
            (1, 13, 3, 2, 3, (2, 3)),
            (2, 1, 4, 2, 1, (1, 2)),
            (2, 7, 1, 2, 1, (0, 0)),
        ] {
            let geometry = ConvGeometry { stride, dilation, pad };
            let inputs = [pattern(&[batch, 3, n_frames], 0.0)?, pattern(&[4, 3, kernel], 7.0)?, pattern(&[4], 3.0)?];
            let own = |v: &[Tensor]| conv1d(&v[0], &v[1], &v[2], geometry);
            let off = apart(&inputs, own, |v| fallback::conv1d(&v[0], &v[1], &v[2], geometry))?;
            let error = worst(&inputs, own)?;
            assert!(off < 1e-12 && error < 1e-7, "{geometry:?} kernel {kernel}: {off:e} {error:e}");
        }
        Ok(())
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bits() -> Result<()> {
        let f32s = |shape: &[usize], phase| pattern(shape, phase)?.to_dtype(DType::F32);
        let (x, bias) = (f32s(&[5, 40, 61], 0.0)?, f32s(&[70], 5.0)?);
        let weight = Var::from_tensor(&f32s(&[70, 40, 3], 1.0)?)?;
        let geometry = ConvGeometry { pad: (1, 1), ..ConvGeometry::VALID };
        any_threads_give_the_same(&weight, || conv1d(&x, &weight, &bias, geometry))
    }

    #[test]
    fn what_does_not_fit_is_an_error() -> Result<()> {
        let (x, weight) = (pattern(&[2, 3, 2], 0.0)?, pattern(&[4, 3, 3], 0.0)?);
        let bias = pattern(&[4], 0.0)?;
        assert_eq!(ConvGeometry::VALID.n_out(3, 4), None);
        assert!(conv1d(&x, &weight, &bias, ConvGeometry::VALID).is_err());
        assert!(conv1d(&x, &pattern(&[4, 2, 1], 0.0)?, &bias, ConvGeometry::VALID).is_err());
        assert!(conv1d(&x, &pattern(&[4, 3, 1], 0.0)?, &bias.narrow(0, 0, 1)?, ConvGeometry::VALID).is_err());
        Ok(())
    }
}
