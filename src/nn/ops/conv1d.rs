//! Convolution over time, channels first, with its own forward and backward passes (the weight gradient of candle's is
//! wrong for batches larger than one). All frames of the batch become the columns of one matrix, so that a pass is one
//! matrix product. Sums have a fixed order, so results do not depend on the number of threads.

use super::operator::{CpuOperator, CustomOperator, Gradients, Operand};
use crate::cpu::axis::ConvAxis;
use crate::cpu::tensor::{GRAIN, Matrix, Scalar, matmul, scratch, sum};
use crate::params::{Init, Params};
use candle_core::{Module, Result, Shape, Tensor};
use rayon::prelude::*;

/// A convolution layer: `<name>.weight` [O, C, K], Glorot uniform, and `<name>.bias` [O], zero.
pub struct Conv1d {
    weight: Tensor,
    /// Constant zeros for a layer without bias.
    bias: Tensor,
    /// `None`: zero padding that preserves the number of frames; otherwise no padding, with this stride.
    stride: Option<usize>,
}

impl Conv1d {
    /// Creates a layer with bias from `n_in` to `n_out` channels that preserves the number of frames.
    pub fn new(params: &mut Params, name: &str, n_in: usize, n_out: usize, kernel: usize) -> Result<Self> {
        let (weight, bias) = params.layer(name, &[n_out, n_in, kernel], Init::Glorot, Init::Constant(0.0))?;
        Ok(Self { weight, bias, stride: None })
    }

    /// Creates a layer with `n` = [input, output] channels, without bias and padding.
    pub fn valid(params: &mut Params, name: &str, n: [usize; 2], kernel: usize, stride: usize) -> Result<Self> {
        let weight = params.trainable(&format!("{name}.weight"), &[n[1], n[0], kernel], Init::Glorot)?;
        let bias = Tensor::zeros(n[1], weight.dtype(), weight.device())?;
        Ok(Self { weight, bias, stride: Some(stride) })
    }

    /// Creates a layer with `n` = [input, output] channels and a bias, both initialised uniformly in +-1 / sqrt(fan
    /// in), as in PyTorch; without padding, or zero padding that preserves the number of frames if `stride` is `None`.
    pub fn with_bias(
        params: &mut Params,
        name: &str,
        n: [usize; 2],
        kernel: usize,
        stride: Option<usize>,
    ) -> Result<Self> {
        let init = Init::Uniform(1.0 / ((n[0] * kernel) as f64).sqrt());
        let (weight, bias) = params.layer(name, &[n[1], n[0], kernel], init, init)?;
        Ok(Self { weight, bias, stride })
    }
}

impl Module for Conv1d {
    /// Maps [B, C, T] to [B, O, T'].
    fn forward(&self, x: &Tensor) -> Result<Tensor> {
        let (n_frames, kernel) = (x.dim(2)?, self.weight.dim(2)?);
        let axis = match self.stride {
            None => ConvAxis::same(n_frames, kernel, 1),
            Some(stride) => ConvAxis::valid(n_frames, kernel, stride),
        };
        conv1d(x, &self.weight, &self.bias, axis)
    }
}

/// Convolves `x` [B, C, T] with `weight` [O, C, K] and adds `bias` [O]: [B, O, T'].
pub fn conv1d(x: &Tensor, weight: &Tensor, bias: &Tensor, axis: ConvAxis) -> Result<Tensor> {
    x.contiguous()?.apply_op3(weight, bias, CustomOperator(Conv1dOp { axis }))
}

struct Conv1dOp {
    axis: ConvAxis,
}

/// Sizes of a pass: the `n` columns are the output frames of the batch, the `depth` rows are (channel, kernel offset).
struct Conv1dSizes {
    batch: usize,
    n_in: usize,
    n_out: usize,
    n: usize,
    depth: usize,
}

impl Conv1dOp {
    fn sizes(&self, x: &[usize], weight: &[usize], n_bias: usize) -> Result<Conv1dSizes> {
        match (x, weight) {
            (&[batch, n_in, t_in], &[n_out, w_in, kernel])
                if n_in == w_in
                    && n_bias == n_out
                    && n_in * n_out * batch * t_in > 0
                    && (t_in, kernel) == (self.axis.n_in, self.axis.kernel)
                    && self.axis.n_out > 0 =>
            {
                Ok(Conv1dSizes { batch, n_in, n_out, n: batch * self.axis.n_out, depth: n_in * kernel })
            }
            _ => candle_core::bail!(
                "conv1d: input {x:?} does not fit weight {weight:?}, bias {n_bias} with {:?}",
                self.axis
            ),
        }
    }

    /// Output frames for which kernel offset `k` lies inside the input, and the input frame of the first of them.
    fn inside(&self, k: usize) -> (std::ops::Range<usize>, usize) {
        let inside = self.axis.inside(k);
        let first = (inside.start * self.axis.stride + k).saturating_sub(self.axis.pad);
        (inside, first)
    }

    /// Unfolds the input: row (c, k), column (b, t) is `x[b, c, t * stride + k - pad]`, zero outside.
    fn columns<T: Scalar>(&self, columns: &mut [T], x: &[T], s: &Conv1dSizes) {
        let ConvAxis { n_in, n_out, kernel, stride, .. } = self.axis;
        let per_channel = kernel * s.n;
        columns.par_chunks_mut(per_channel).with_min_len(GRAIN / per_channel).enumerate().for_each(|(c, rows)| {
            for (k, row) in rows.chunks_exact_mut(s.n).enumerate() {
                let (inside, first) = self.inside(k);
                for (b, row) in row.chunks_exact_mut(n_out).enumerate() {
                    let x = &x[(b * s.n_in + c) * n_in..][..n_in];
                    row[..inside.start].fill(T::zero());
                    row[inside.end..].fill(T::zero());
                    let row = &mut row[inside.clone()];
                    match stride {
                        1 => row.copy_from_slice(&x[first.min(n_in)..][..row.len()]),
                        stride => row.iter_mut().enumerate().for_each(|(t, y)| *y = x[first + t * stride]),
                    }
                }
            }
        });
    }

    /// Transpose of `columns`: adds every entry to the input frame that it came from, in the order of kernel offsets.
    fn uncolumns<T: Scalar>(&self, x: &mut [T], columns: &[T], s: &Conv1dSizes) {
        let ConvAxis { n_in, n_out, kernel, stride, .. } = self.axis;
        x.par_chunks_mut(n_in).with_min_len(GRAIN / (n_in * kernel)).enumerate().for_each(|(row, x)| {
            let (b, c) = (row / s.n_in, row % s.n_in);
            for k in 0..kernel {
                let (inside, first) = self.inside(k);
                let grad = &columns[(c * kernel + k) * s.n + b * n_out..][..n_out][inside];
                match stride {
                    1 => x[first.min(n_in)..].iter_mut().zip(grad).for_each(|(x, g)| *x += *g),
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
        let t_out = self.axis.n_out;
        let mut y = vec![T::zero(); s.n_out * s.n];
        scratch(s.depth * s.n + y.len(), |memory: &mut [T]| {
            let (columns, product) = memory.split_at_mut(s.depth * s.n);
            self.columns(columns, x.values, s);
            matmul(product, Matrix::new(weight.values, s.depth), Matrix::new(columns, s.n), s.n_out, s.n, s.depth);
            y.par_chunks_mut(t_out).with_min_len(GRAIN / t_out).enumerate().for_each(|(row, y)| {
                let (b, o) = (row / s.n_out, row % s.n_out);
                let product = &product[(o * s.batch + b) * t_out..][..t_out];
                y.iter_mut().zip(product).for_each(|(y, sum)| *y = *sum + bias.values[o]);
            });
        });
        Ok((y, Shape::from((s.batch, s.n_out, t_out))))
    }

    fn backward<T: Scalar>(&self, [x, weight, bias]: [Operand<T>; 3], _: &[T], grad: &[T]) -> Gradients<T> {
        let s = &self.sizes(x.dims, weight.dims, bias.values.len())?;
        let t_out = self.axis.n_out;
        let zeros = |n| vec![T::zero(); n];
        let mut grad_x = zeros(x.values.len());
        let (mut grad_weight, mut grad_bias) = (zeros(s.n_out * s.depth), zeros(s.n_out));
        scratch(s.depth * s.n + grad.len(), |memory: &mut [T]| {
            let (columns, rows) = memory.split_at_mut(s.depth * s.n);
            // Gradient of the batch with one row per output channel.
            rows.par_chunks_mut(s.n).zip(&mut grad_bias).with_min_len(GRAIN / s.n).enumerate().for_each(
                |(o, (row, grad_bias))| {
                    for (b, row) in row.chunks_exact_mut(t_out).enumerate() {
                        row.copy_from_slice(&grad[(b * s.n_out + o) * t_out..][..t_out]);
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
