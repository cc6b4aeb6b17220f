//! The operators of this crate composed of candle's, for devices other than the CPU: slower, but every part has a
//! gradient that finite differences confirm and runs wherever candle does. On the CPU they are used only in tests,
//! which check that they give the same results as this crate's operators.

use crate::cpu::axis::ConvAxis;
use crate::cpu::direct_conv::ConvSizes;
use candle_core::{D, Result, Tensor};

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
pub fn conv_first(x: &Tensor, weight: &Tensor, bias: &Tensor, s: &ConvSizes) -> Result<Tensor> {
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
pub fn last(y: &Tensor, rank: usize) -> Result<Tensor> {
    let y = y.permute((0, 2, 3, 1))?;
    if rank == 3 { y.squeeze(2)?.contiguous() } else { y.contiguous() }
}

/// Convolution, channels last, as [`super::conv2d::Conv`].
pub fn conv(x: &Tensor, weight: &Tensor, bias: &Tensor, s: &ConvSizes) -> Result<Tensor> {
    last(&conv_first(x, weight, bias, s)?, x.rank())
}

/// Mean and biased variance of every channel of [B, C, ...], [C] each.
pub fn statistics(x: &Tensor) -> Result<(Tensor, Tensor)> {
    let (batch, channels) = (x.dim(0)?, x.dim(1)?);
    let rows = x.reshape((batch, channels, ()))?.transpose(0, 1)?.contiguous()?.reshape((channels, ()))?;
    let mean = rows.mean_keepdim(1)?;
    let variance = rows.broadcast_sub(&mean)?.sqr()?.mean(D::Minus1)?;
    Ok((mean.squeeze(1)?, variance))
}

/// Batch norm with these statistics ([C] each, part of the graph in training), then leaky ReLU with this slope.
pub fn normalise(
    x: &Tensor,
    (mean, variance): (&Tensor, &Tensor),
    weight: &Tensor,
    bias: &Tensor,
    eps: f64,
    slope: f64,
) -> Result<Tensor> {
    let mut shape = vec![1; x.rank()];
    shape[1] = x.dim(1)?;
    let column = |v: &Tensor| v.reshape(shape.as_slice());
    let centred = x.broadcast_sub(&column(mean)?)?;
    let scale = (weight / (variance + eps)?.sqrt()?)?;
    let y = centred.broadcast_mul(&column(&scale)?)?.broadcast_add(&column(bias)?)?;
    match slope {
        1.0 => Ok(y),
        0.0 => y.relu(),
        _ => candle_nn::ops::leaky_relu(&y, slope),
    }
}
