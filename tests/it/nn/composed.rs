//! Convolution and batch norm composed of candle's operators, whose gradients finite differences confirm, as a reference
//! for the kernels.

use candle_core::{D, Result, Tensor};
use orator_nn::cpu::axis::ConvAxis;
use orator_nn::cpu::direct_conv::ConvSizes;

/// Pads axis `dim` of `x` by `before`, then pads or cuts its end to `len` positions in total, so that the kernel
/// reaches exactly the last one: with remaining positions candle's backward pass fails.
fn fitted(x: &Tensor, dim: usize, before: usize, len: usize) -> Result<Tensor> {
    let (n, end) = (x.dim(dim)?, len.saturating_sub(before));
    if end < n {
        return x.narrow(dim, 0, end)?.pad_with_zeros(dim, before, 0);
    }
    x.pad_with_zeros(dim, before, end - n)
}

/// Convolves `x` [B, T, C] or [B, T, F, C] with `weight` [O, C, K] or [O, C, K, K'] and adds `bias` [O]; the result is
/// channels first, [B, O, T', F'].
fn conv_first(x: &Tensor, weight: &Tensor, bias: &Tensor, s: &ConvSizes) -> Result<Tensor> {
    let (x, weight) = match x.rank() {
        3 => (x.unsqueeze(2)?, weight.unsqueeze(3)?),
        _ => (x.clone(), weight.clone()),
    };
    let mut x = x.permute((0, 3, 1, 2))?;
    let [down, across] = s.axes;
    // A convolution over time only has one frequency, for which every stride gives one position.
    let stride = down.stride;
    if across.stride != stride && across.n_out != 1 {
        candle_core::bail!(
            "convolution: strides {} and {} differ: expected one stride for both axes",
            down.stride,
            across.stride
        );
    }
    for (dim, ConvAxis { n_out, kernel, pad, .. }) in [(2, down), (3, across)] {
        x = fitted(&x, dim, pad, (n_out - 1) * stride + kernel)?;
    }
    let y = x.contiguous()?.conv2d(&weight.contiguous()?, 0, stride, 1, 1)?;
    y.broadcast_add(&bias.reshape((1, (), 1, 1))?)
}

/// Converts channels first to channels last, with the rank of the input.
fn last(y: &Tensor, rank: usize) -> Result<Tensor> {
    let y = y.permute((0, 2, 3, 1))?;
    if rank == 3 { y.squeeze(2)?.contiguous() } else { y.contiguous() }
}

/// Convolution, channels last.
pub(crate) fn conv(x: &Tensor, weight: &Tensor, bias: &Tensor, s: &ConvSizes) -> Result<Tensor> {
    last(&conv_first(x, weight, bias, s)?, x.rank())
}

/// Settings of a batch norm with leaky ReLU, and its tensors [C].
pub(crate) struct ComposedNorm<'a> {
    pub(crate) weight: &'a Tensor,
    pub(crate) bias: &'a Tensor,
    /// Mean and variance; `None`: those of the batch.
    pub(crate) statistics: Option<[&'a Tensor; 2]>,
    pub(crate) eps: f64,
    pub(crate) slope: f64,
}

/// Convolution, batch norm and leaky ReLU, channels last, with the mean and the biased variance of the batch.
pub(crate) fn conv_norm(
    [x, weight, bias]: [&Tensor; 3],
    norm: &ComposedNorm,
    s: &ConvSizes,
) -> Result<(Tensor, [Tensor; 2])> {
    let z = conv_first(x, weight, bias, s)?;
    let rows = z.reshape((s.batch, s.n_out, ()))?.transpose(0, 1)?.contiguous()?.reshape((s.n_out, ()))?;
    let mean = rows.mean_keepdim(1)?;
    let variance = rows.broadcast_sub(&mean)?.sqr()?.mean(D::Minus1)?;
    let batch = [mean.squeeze(1)?, variance];
    let [mean, variance] = norm.statistics.unwrap_or([&batch[0], &batch[1]]);
    let column = |v: &Tensor| v.reshape((1, (), 1, 1));
    let scale = (norm.weight / (variance + norm.eps)?.sqrt()?)?;
    let y = z.broadcast_sub(&column(mean)?)?.broadcast_mul(&column(&scale)?)?.broadcast_add(&column(norm.bias)?)?;
    let y = if norm.slope == 1.0 { y } else { candle_nn::ops::leaky_relu(&y, norm.slope)? };
    Ok((last(&y, x.rank())?, batch))
}
