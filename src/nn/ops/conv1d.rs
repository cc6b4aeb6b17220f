//! Convolution over time with its own forward and backward passes (the stock one's weight gradient is wrong for every
//! batch larger than one). All frames of the whole batch become the columns of one matrix, so that a pass is one
//! matrix product; sums run in a fixed order, so results do not depend on the number of threads.

use super::fallback;
use crate::nn::cpu::axis::ConvGeometry;
use crate::nn::cpu::tensor::{GRAIN, Matrix, Scalar, is_f64, matmul, read, scratch, slice, sum};
use crate::nn::params::{Init, Params};
use candle_core::backend::BackendStorage;
use candle_core::{CpuStorage, CustomOp3, Layout, Result, Shape, Tensor};
use rayon::prelude::*;

/// Convolves `x` [B, C, T] with `weight` [O, C, K] and adds `bias` [O]: [B, O, T'], T' = `walk.n_out(T, K)`. f32 or
/// f64.
pub fn conv1d(x: &Tensor, weight: &Tensor, bias: &Tensor, geometry: ConvGeometry) -> Result<Tensor> {
    if crate::nn::device::needs_fallback(x) {
        return fallback::conv1d(x, weight, bias, geometry);
    }
    x.contiguous()?.apply_op3(&weight.contiguous()?, &bias.contiguous()?, Conv1dOp { geometry })
}

/// Padding of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Padding {
    Valid,
    /// TensorFlow's "same" (see [`ConvGeometry::same`]); dilation must be 1.
    Same,
}

/// A convolution with its weights: `<name>.weight` [O, C, K], Glorot uniform, and `<name>.bias` [O], zero.
pub struct Conv1d {
    weight: Tensor,
    /// Constant zeros for a layer without bias.
    bias: Tensor,
    stride: usize,
    dilation: usize,
    padding: Padding,
}

impl Conv1d {
    /// `n_in` channels to `n_out`, stride 1, no dilation, padding "same", with bias.
    pub fn new(params: &mut Params, name: &str, n_in: usize, n_out: usize, kernel: usize) -> Result<Self> {
        let weight = params.trainable(&format!("{name}.weight"), &[n_out, n_in, kernel], Init::Glorot)?;
        let bias = params.trainable(&format!("{name}.bias"), &[n_out], Init::Constant(0.0))?;
        Ok(Self { weight, bias, stride: 1, dilation: 1, padding: Padding::Same })
    }

    /// `n_in` channels to `n_out`, stride 1, without bias and padding, with this dilation.
    pub fn valid(
        params: &mut Params,
        name: &str,
        n_in: usize,
        n_out: usize,
        kernel: usize,
        dilation: usize,
    ) -> Result<Self> {
        let weight = params.trainable(&format!("{name}.weight"), &[n_out, n_in, kernel], Init::Glorot)?;
        let bias = Tensor::zeros(n_out, weight.dtype(), weight.device())?;
        Ok(Self { weight, bias, stride: 1, dilation, padding: Padding::Valid })
    }

    /// Every `stride`-th output only.
    pub fn with_stride(self, stride: usize) -> Self {
        Self { stride, ..self }
    }

    /// [B, C, T] to [B, O, T'].
    pub fn forward(&self, x: &Tensor) -> Result<Tensor> {
        let (_, _, kernel) = self.weight.dims3()?;
        let geometry = match self.padding {
            Padding::Same => ConvGeometry::same(x.dim(2)?, kernel, self.stride),
            Padding::Valid => ConvGeometry { stride: self.stride, dilation: self.dilation, pad: (0, 0) },
        };
        conv1d(x, &self.weight, &self.bias, geometry)
    }

    /// The strided form of a dilated layer: the same weights on frames that lie `dilation` apart already, kernels
    /// side by side without overlap, so that a training window of one receptive field costs no wasted work.
    pub fn forward_strided(&self, x: &Tensor) -> Result<Tensor> {
        let (_, _, kernel) = self.weight.dims3()?;
        conv1d(x, &self.weight, &self.bias, ConvGeometry { stride: kernel, ..ConvGeometry::VALID })
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
    fn sizes(&self, x: (usize, usize, usize), weight: (usize, usize, usize), n_bias: usize) -> Result<Conv1dSizes> {
        let ((batch, n_in, t_in), (n_out, w_in, kernel)) = (x, weight);
        let t_out = self
            .geometry
            .n_out(t_in, kernel)
            .filter(|_| n_in == w_in && n_bias == n_out && n_in * n_out * batch * t_in > 0);
        let Some(t_out) = t_out else {
            candle_core::bail!(
                "conv1d: input {x:?} does not fit weight {weight:?}, bias {n_bias} with {:?}",
                self.geometry
            );
        };
        Ok(Conv1dSizes { batch, n_in, n_out, kernel, t_in, t_out, n: batch * t_out, depth: n_in * kernel })
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

    fn forward<T: Scalar>(&self, x: &[T], weight: &[T], bias: &[T], s: &Conv1dSizes) -> Vec<T> {
        let mut y = vec![T::zero(); s.n_out * s.n];
        scratch(s.depth * s.n + y.len(), |memory: &mut [T]| {
            let (columns, product) = memory.split_at_mut(s.depth * s.n);
            self.columns(columns, x, s);
            matmul(product, Matrix::new(weight, s.depth), Matrix::new(columns, s.n), s.n_out, s.n, s.depth);
            y.par_chunks_mut(s.t_out).with_min_len(GRAIN / s.t_out).enumerate().for_each(|(row, y)| {
                let (b, o) = (row / s.n_out, row % s.n_out);
                let product = &product[(o * s.batch + b) * s.t_out..][..s.t_out];
                y.iter_mut().zip(product).for_each(|(y, sum)| *y = *sum + bias[o]);
            });
        });
        y
    }

    /// Gradients of `x`, of the weight and of the bias.
    fn backward<T: Scalar>(&self, x: &[T], weight: &[T], grad: &[T], s: &Conv1dSizes) -> [Vec<T>; 3] {
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
            self.columns(columns, x, s);
            matmul(&mut grad_weight, rows, Matrix::new(columns, s.n).transposed(), s.n_out, s.depth, s.n);
            matmul(columns, Matrix::new(weight, s.depth).transposed(), rows, s.depth, s.n, s.n_out);
            self.uncolumns(&mut grad_x, columns, s);
        });
        [grad_x, grad_weight, grad_bias]
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

impl CustomOp3 for Conv1dOp {
    fn name(&self) -> &'static str {
        "conv1d over time"
    }

    fn cpu_fwd(
        &self,
        x: &CpuStorage,
        lx: &Layout,
        w: &CpuStorage,
        lw: &Layout,
        b: &CpuStorage,
        lb: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let s = self.sizes(lx.shape().dims3()?, lw.shape().dims3()?, lb.shape().dims1()?)?;
        let y = if is_f64(x.dtype())? {
            CpuStorage::F64(self.forward(slice(x, lx)?, slice(w, lw)?, slice(b, lb)?, &s))
        } else {
            CpuStorage::F32(self.forward(slice(x, lx)?, slice(w, lw)?, slice(b, lb)?, &s))
        };
        Ok((y, Shape::from((s.batch, s.n_out, s.t_out))))
    }

    fn bwd(
        &self,
        x: &Tensor,
        w: &Tensor,
        b: &Tensor,
        _y: &Tensor,
        grad: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>, Option<Tensor>)> {
        fn typed<T: Scalar>(
            op: &Conv1dOp,
            x: &Tensor,
            w: &Tensor,
            grad: &Tensor,
            s: &Conv1dSizes,
        ) -> Result<[Tensor; 3]> {
            let [grad_x, grad_w, grad_b] =
                read::<T, _>(x, |x| read::<T, _>(w, |w| read::<T, _>(grad, |grad| Ok(op.backward(x, w, grad, s)))))?;
            let device = x.device();
            Ok([
                Tensor::from_vec(grad_x, x.shape(), device)?,
                Tensor::from_vec(grad_w, w.shape(), device)?,
                Tensor::from_vec(grad_b, s.n_out, device)?,
            ])
        }
        let s = self.sizes(x.dims3()?, w.dims3()?, b.dims1()?)?;
        let typed = if is_f64(x.dtype())? { typed::<f64> } else { typed::<f32> };
        let [grad_x, grad_w, grad_b] = typed(self, x, w, grad, &s)?;
        Ok((Some(grad_x), Some(grad_w), Some(grad_b)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nn::ops::gradcheck::{pattern, worst};

    /// The sum as written in a textbook.
    fn by_definition(x: &Tensor, weight: &Tensor, bias: &Tensor, geometry: ConvGeometry) -> Result<Vec<f64>> {
        let (batch, n_in, t_in) = x.dims3()?;
        let (n_out, _, kernel) = weight.dims3()?;
        let (x, weight) = (x.flatten_all()?.to_vec1::<f64>()?, weight.flatten_all()?.to_vec1::<f64>()?);
        let bias = bias.to_vec1::<f64>()?;
        let t_out = geometry.n_out(t_in, kernel).unwrap_or(0);
        let mut y = vec![0.0; batch * n_out * t_out];
        for (i, y) in y.iter_mut().enumerate() {
            let (b, o, t) = (i / (n_out * t_out), i / t_out % n_out, i % t_out);
            *y = bias[o];
            for (c, k) in (0..n_in).flat_map(|c| (0..kernel).map(move |k| (c, k))) {
                let at = t * geometry.stride + k * geometry.dilation;
                if at >= geometry.pad.0 && at < geometry.pad.0 + t_in {
                    *y += x[(b * n_in + c) * t_in + at - geometry.pad.0] * weight[(o * n_in + c) * kernel + k];
                }
            }
        }
        Ok(y)
    }

    #[test]
    fn forward_and_gradients_are_right() -> Result<()> {
        for (batch, n_frames, kernel, stride, dilation, pad) in [
            (2, 9, 1, 1, 1, (0, 0)),
            (3, 11, 3, 1, 1, (1, 1)),
            (2, 13, 4, 2, 1, (1, 2)),
            (2, 12, 4, 2, 1, (1, 1)),
            (2, 8, 4, 1, 1, (1, 2)),
            (2, 9, 3, 3, 1, (0, 0)),
            (2, 11, 3, 1, 3, (0, 0)),
            (2, 21, 3, 1, 9, (0, 0)),
            (1, 13, 3, 2, 3, (2, 3)),
            (2, 1, 4, 2, 1, (1, 2)),
            (2, 7, 1, 2, 1, (0, 0)),
        ] {
            let geometry = ConvGeometry { stride, dilation, pad };
            let (x, weight) = (pattern(&[batch, 3, n_frames], 0.0)?, pattern(&[4, 3, kernel], 7.0)?);
            let bias = pattern(&[4], 3.0)?;
            let y = conv1d(&x, &weight, &bias, geometry)?.flatten_all()?.to_vec1::<f64>()?;
            let expected = by_definition(&x, &weight, &bias, geometry)?;
            assert_eq!(y.len(), expected.len());
            assert!(y.iter().zip(&expected).all(|(y, e)| (y - e).abs() < 1e-12), "{geometry:?} kernel {kernel}");
            let error = worst(&[x, weight, bias], |v| conv1d(&v[0], &v[1], &v[2], geometry))?;
            assert!(error < 1e-7, "{geometry:?} kernel {kernel}: {error}");
        }
        Ok(())
    }

    #[test]
    fn same_padding_is_tensorflows() {
        assert_eq!(ConvGeometry::same(209, 4, 2).pad, (1, 2));
        assert_eq!(ConvGeometry::same(63, 4, 2).pad, (1, 2));
        assert_eq!(ConvGeometry::same(64, 4, 2).pad, (1, 1));
        assert_eq!(ConvGeometry::same(16, 4, 1).pad, (1, 2));
        assert_eq!(ConvGeometry::same(209, 4, 2).n_out(209, 4), Some(105));
        assert_eq!(ConvGeometry::VALID.n_out(3, 4), None);
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bits() -> Result<()> {
        let x = pattern(&[5, 40, 61], 0.0)?.to_dtype(candle_core::DType::F32)?;
        let weight = candle_core::Var::from_tensor(&pattern(&[70, 40, 3], 1.0)?.to_dtype(candle_core::DType::F32)?)?;
        let bias = pattern(&[70], 5.0)?.to_dtype(candle_core::DType::F32)?;
        let run = |n_threads| -> Result<Vec<Vec<f32>>> {
            let pool =
                rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().map_err(candle_core::Error::wrap)?;
            pool.install(|| {
                let y = conv1d(&x, &weight, &bias, ConvGeometry::same(61, 3, 1))?;
                let gradients = y.sqr()?.sum_all()?.backward()?;
                let gradient = gradients.get(&weight).ok_or_else(|| candle_core::Error::msg("no gradient"))?;
                Ok(vec![y.flatten_all()?.to_vec1()?, gradient.flatten_all()?.to_vec1()?])
            })
        };
        assert_eq!(run(1)?, run(3)?);
        Ok(())
    }

    #[test]
    fn what_does_not_fit_is_an_error() -> Result<()> {
        let (x, weight) = (pattern(&[2, 3, 2], 0.0)?, pattern(&[4, 3, 3], 0.0)?);
        let bias = pattern(&[4], 0.0)?;
        assert!(conv1d(&x, &weight, &bias, ConvGeometry::VALID).is_err());
        assert!(conv1d(&x, &pattern(&[4, 2, 1], 0.0)?, &bias, ConvGeometry::VALID).is_err());
        assert!(conv1d(&x, &pattern(&[4, 3, 1], 0.0)?, &bias.narrow(0, 0, 1)?, ConvGeometry::VALID).is_err());
        Ok(())
    }
}
