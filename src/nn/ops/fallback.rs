//! The operators of this room made of the framework's own, for devices that are not the CPU: slower, but every part has
//! a gradient that finite differences confirm, and runs wherever the framework does. On the CPU they are only tested:
//! they give what the room's own operators give.

use crate::nn::cpu::axis::ConvAxis;
use crate::nn::cpu::axis::ConvGeometry;
use crate::nn::cpu::direct_conv::ConvSizes;
use candle_core::{D, Result, Tensor};

/// Pads axis `dim` of `x` by `before`, and on the other side pads or cuts it to `reach` places in all, so that a kernel
/// walks to the very last one: with some left over the framework's backward pass fails.
fn fitted(x: &Tensor, dim: usize, before: usize, len: usize) -> Result<Tensor> {
    let (n, end) = (x.dim(dim)?, len.saturating_sub(before));
    if end < n {
        return x.narrow(dim, 0, end)?.pad_with_zeros(dim, before, 0);
    }
    x.pad_with_zeros(dim, before, end - n)
}

/// A convolution of pictures one place high.
pub fn conv1d(x: &Tensor, weight: &Tensor, bias: &Tensor, geometry: ConvGeometry) -> Result<Tensor> {
    let (n, kernel) = (x.dim(2)?, weight.dim(2)?);
    let Some(n_out) = geometry.n_out(n, kernel) else {
        candle_core::bail!("a kernel of {kernel} does not fit into {n} frames with {geometry:?}");
    };
    let len = (n_out - 1) * geometry.stride + geometry.dilation * (kernel - 1) + 1;
    let x = fitted(x, 2, geometry.pad.0, len)?.unsqueeze(2)?.contiguous()?;
    let weight = weight.unsqueeze(2)?.contiguous()?;
    let y = x.conv2d(&weight, 0, geometry.stride, geometry.dilation, 1)?.squeeze(2)?;
    y.broadcast_add(&bias.reshape((1, (), 1))?)
}

/// A convolution of `x` [B, T, C] or [B, T, F, C] with `weight` [O, C, K] or [O, C, K, K'], and `bias` [O]: channels
/// first, [B, O, T', F'].
pub fn conv_first(x: &Tensor, weight: &Tensor, bias: &Tensor, s: &ConvSizes) -> Result<Tensor> {
    let (x, weight) = match x.rank() {
        3 => (x.unsqueeze(2)?, weight.unsqueeze(3)?),
        _ => (x.clone(), weight.clone()),
    };
    let mut x = x.permute((0, 3, 1, 2))?;
    let [down, across] = s.axes;
    // Over time alone there is one frequency, on which every stride stands once.
    let stride = down.stride;
    if across.stride != stride && across.n_out != 1 {
        candle_core::bail!("one stride for both axes, not {} and {}", down.stride, across.stride);
    }
    for (dim, ConvAxis { n_out, kernel, pad, .. }) in [(2, down), (3, across)] {
        x = fitted(&x, dim, pad, (n_out - 1) * stride + kernel)?;
    }
    let y = x.contiguous()?.conv2d(&weight.contiguous()?, 0, stride, 1, 1)?;
    y.broadcast_add(&bias.reshape((1, (), 1, 1))?)
}

/// From channels first to channels last, and to the rank that the input had.
pub fn last(y: &Tensor, rank: usize) -> Result<Tensor> {
    let y = y.permute((0, 2, 3, 1))?;
    if rank == 3 { y.squeeze(2)?.contiguous() } else { y.contiguous() }
}

/// A convolution, channels last: as [`super::conv2d::Conv`].
pub fn conv(x: &Tensor, weight: &Tensor, bias: &Tensor, s: &ConvSizes) -> Result<Tensor> {
    last(&conv_first(x, weight, bias, s)?, x.rank())
}

/// Every frame twice, as [`super::resize::twice`].
pub fn twice(x: &Tensor) -> Result<Tensor> {
    let (batch, n_frames, channels) = x.dims3()?;
    let pairs = x.unsqueeze(2)?.broadcast_as((batch, n_frames, 2, channels))?.contiguous()?;
    pairs.reshape((batch, 2 * n_frames, channels))
}

/// Mean and variance (of the batch itself, not the estimate) of every channel of [B, C, ...], [C] each.
pub fn statistics(x: &Tensor) -> Result<(Tensor, Tensor)> {
    let (batch, channels) = (x.dim(0)?, x.dim(1)?);
    let rows = x.reshape((batch, channels, ()))?.transpose(0, 1)?.contiguous()?.reshape((channels, ()))?;
    let mean = rows.mean_keepdim(1)?;
    let variance = rows.broadcast_sub(&mean)?.sqr()?.mean(D::Minus1)?;
    Ok((mean.squeeze(1)?, variance))
}

/// Batch norm with these statistics ([C] each, part of the graph while training), then the leaky ReLU of this slope.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nn::ops::batch_norm::BatchNorm;
    use crate::nn::ops::conv_norm::{self, fallback_conv_norm};
    use crate::nn::ops::gradcheck::{pattern, worst};
    use crate::nn::ops::{conv1d as own, conv2d, resize};
    use crate::nn::params::Params;
    use candle_core::{DType, Var};

    /// Largest difference of the results and of the gradients of all inputs.
    fn apart(
        inputs: &[Tensor],
        a: impl Fn(&[Tensor]) -> Result<Tensor>,
        b: impl Fn(&[Tensor]) -> Result<Tensor>,
    ) -> Result<f64> {
        let vars = inputs.iter().map(Var::from_tensor).collect::<Result<Vec<_>>>()?;
        let inputs: Vec<Tensor> = vars.iter().map(|var| var.as_tensor().clone()).collect();
        let (a, b) = (a(&inputs)?, b(&inputs)?);
        let most = |a: &Tensor, b: &Tensor| (a - b)?.abs()?.max_all()?.to_scalar::<f64>();
        let backward = |y: &Tensor| (y * pattern(y.dims(), 0.5)?)?.sum_all()?.backward();
        let (of_a, of_b) = (backward(&a)?, backward(&b)?);
        let mut worst = most(&a, &b)?;
        for var in &vars {
            let (Some(a), Some(b)) = (of_a.get(var), of_b.get(var)) else { candle_core::bail!("no gradient") };
            worst = worst.max(most(a, b)?);
        }
        Ok(worst)
    }

    #[test]
    fn convolution_over_time_is_the_rooms_own() -> Result<()> {
        for (n_frames, kernel, stride, dilation, pad) in [
            (9, 1, 1, 1, (0, 0)),
            (11, 3, 1, 1, (1, 1)),
            (13, 4, 2, 1, (1, 2)),
            (12, 4, 2, 1, (1, 1)),
            (12, 3, 2, 1, (0, 0)),
            (11, 3, 3, 1, (0, 0)),
            (21, 3, 1, 9, (0, 0)),
            (13, 3, 2, 3, (2, 3)),
            (1, 4, 2, 1, (1, 2)),
        ] {
            let geometry = ConvGeometry { stride, dilation, pad };
            let inputs = [pattern(&[3, 2, n_frames], 0.0)?, pattern(&[4, 2, kernel], 7.0)?, pattern(&[4], 3.0)?];
            let by_fallback = |v: &[Tensor]| conv1d(&v[0], &v[1], &v[2], geometry);
            let off = apart(&inputs, by_fallback, |v| own::conv1d(&v[0], &v[1], &v[2], geometry))?;
            assert!(off < 1e-12, "{geometry:?} kernel {kernel}: {off:e}");
            assert!(worst(&inputs, by_fallback)? < 1e-7, "{geometry:?} kernel {kernel}");
        }
        Ok(())
    }

    /// Inputs and kernels of the networks' layers, small: over time, over time and frequency, even and odd.
    const LAYERS: [(&[usize], &[usize], usize); 8] = [
        (&[2, 9, 2], &[3, 2, 3], 1),
        (&[2, 12, 2], &[3, 2, 4], 2),
        (&[2, 13, 2], &[3, 2, 4], 2),
        (&[3, 16, 2], &[3, 2, 4], 1),
        (&[2, 7, 2], &[3, 2, 1], 1),
        (&[2, 6, 5, 2], &[3, 2, 3, 3], 1),
        (&[2, 9, 8, 2], &[3, 2, 4, 4], 2),
        (&[2, 7, 7, 1], &[3, 1, 4, 4], 2),
    ];

    #[test]
    fn convolution_channels_last_is_the_rooms_own() -> Result<()> {
        for (shape, kernel, stride) in LAYERS {
            let inputs = [pattern(shape, 0.0)?, pattern(kernel, 7.0)?, pattern(&kernel[..1], 3.0)?];
            let s = conv2d::same(&inputs[0], &inputs[1], stride)?;
            let by_fallback = |v: &[Tensor]| conv(&v[0], &v[1], &v[2], &s);
            let off = apart(&inputs, by_fallback, |v| conv2d::conv(&v[0], &v[1], &v[2], s))?;
            assert!(off < 1e-12, "{shape:?} {kernel:?}: {off:e}");
            assert!(worst(&inputs, by_fallback)? < 1e-7, "{shape:?} {kernel:?}");
        }
        Ok(())
    }

    #[test]
    fn a_whole_layer_is_the_rooms_own_with_its_running_statistics() -> Result<()> {
        for ((shape, kernel, stride), train) in LAYERS.into_iter().flat_map(|layer| [(layer, true), (layer, false)]) {
            let inputs = [pattern(shape, 0.0)?, pattern(kernel, 7.0)?, pattern(&kernel[..1], 3.0)?];
            let s = conv2d::same(&inputs[0], &inputs[1], stride)?;
            let norm = |slope| BatchNorm::new(&mut Params::with_dtype(0, DType::F64), "n", 3, 1e-3, 0.1, slope);
            let (mine, own) = (norm(0.2)?, norm(0.2)?);
            let by_fallback = |v: &[Tensor]| fallback_conv_norm(&v[0], &v[1], &v[2], &mine, &s, train);
            let off = apart(&inputs, by_fallback, |v| conv_norm::conv_norm(&v[0], &v[1], &v[2], &own, s, train))?;
            assert!(off < 1e-11, "{shape:?} {kernel:?} {train}: {off:e}");
            let (mine, own) = (mine.running()?, own.running()?);
            let pairs = mine.mean.iter().chain(&mine.variance).zip(own.mean.iter().chain(&own.variance));
            assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-12), "{mine:?} {own:?}");
        }
        Ok(())
    }

    #[test]
    fn every_frame_twice_is_the_rooms_own() -> Result<()> {
        let inputs = [pattern(&[2, 3, 5], 0.0)?];
        let skip = |twice: fn(&Tensor) -> Result<Tensor>| {
            move |v: &[Tensor]| {
                let early = v[0].sqr()?;
                twice(&early)? * twice(&early.sin()?)? + twice(&early)?
            }
        };
        assert!(apart(&inputs, skip(twice), skip(resize::twice))? < 1e-12);
        assert!(worst(&inputs, skip(twice))? < 1e-7);
        Ok(())
    }

    #[test]
    fn normalising_has_right_gradients() -> Result<()> {
        for (shape, slope) in [(&[4, 3, 5][..], 0.2), (&[4, 3, 5], 1.0), (&[2, 3, 4, 5], 0.2), (&[5, 3], 0.0)] {
            let inputs = [pattern(shape, 0.0)?, (pattern(&[3], 5.0)? + 1.5)?, pattern(&[3], 9.0)?];
            let train = |v: &[Tensor]| {
                let (mean, variance) = statistics(&v[0])?;
                normalise(&v[0], (&mean, &variance), &v[1], &v[2], 1e-3, slope)
            };
            let error = worst(&inputs, train)?;
            assert!(error < 1e-7, "{shape:?} {slope}: {error:e}");
        }
        Ok(())
    }
}
