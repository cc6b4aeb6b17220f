//! The operators of this room made of the framework's own, for devices that are not the CPU: slower, but every part has
//! a gradient that finite differences confirm, and runs wherever the framework does. On the CPU they are only tested:
//! they give what the room's own operators give.

use super::conv1d::Walk;
use candle_core::{D, Result, Tensor};

/// Whether the tensor lives where this room's own operators do not run.
pub fn needed(x: &Tensor) -> bool {
    !x.device().is_cpu()
}

/// Pads axis `dim` of `x`, or cuts its end, so that a kernel walks to the very last place: with some left over the
/// framework's backward pass fails.
fn fitted(x: &Tensor, dim: usize, kernel: usize, walk: Walk) -> Result<Tensor> {
    let n = x.dim(dim)?;
    let Some(n_out) = walk.n_out(n, kernel) else {
        candle_core::bail!("a kernel of {kernel} does not fit into {n} places with {walk:?}");
    };
    let reach = (n_out - 1) * walk.stride + walk.dilation * (kernel - 1) + 1;
    let end = reach.saturating_sub(walk.pad.0);
    if end < n {
        return x.narrow(dim, 0, end)?.pad_with_zeros(dim, walk.pad.0, 0);
    }
    x.pad_with_zeros(dim, walk.pad.0, end - n)
}

/// As [`super::conv1d::conv1d`]: a convolution of pictures one place high.
pub fn conv1d(x: &Tensor, weight: &Tensor, bias: &Tensor, walk: Walk) -> Result<Tensor> {
    let x = fitted(x, 2, weight.dim(2)?, walk)?.unsqueeze(2)?.contiguous()?;
    let weight = weight.unsqueeze(2)?.contiguous()?;
    let y = x.conv2d(&weight, 0, walk.stride, walk.dilation, 1)?.squeeze(2)?;
    y.broadcast_add(&bias.reshape((1, (), 1))?)
}

/// Convolves `x` [B, C, T, F] with `weight` [O, C, K, L] and adds `bias` [O]; one stride and dilation for both axes.
pub fn conv2d(x: &Tensor, weight: &Tensor, bias: &Tensor, [over_time, across]: [Walk; 2]) -> Result<Tensor> {
    if (over_time.stride, over_time.dilation) != (across.stride, across.dilation) {
        candle_core::bail!("one stride and dilation for both axes, not {over_time:?} and {across:?}");
    }
    let (_, _, height, width) = weight.dims4()?;
    let x = fitted(&fitted(x, 2, height, over_time)?, 3, width, across)?.contiguous()?;
    let y = x.conv2d(&weight.contiguous()?, 0, over_time.stride, over_time.dilation, 1)?;
    y.broadcast_add(&bias.reshape((1, (), 1, 1))?)
}

/// As [`super::resize::twice`].
pub fn twice(x: &Tensor) -> Result<Tensor> {
    let (batch, n_frames, channels) = x.dims3()?;
    x.unsqueeze(2)?.broadcast_as((batch, n_frames, 2, channels))?.contiguous()?.reshape((batch, 2 * n_frames, channels))
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
    use crate::nn::finite_difference::{pattern, worst};
    use crate::nn::{conv1d as own, resize};

    /// Largest difference of the results and of the gradients of all inputs.
    fn apart(
        inputs: &[Tensor],
        a: impl Fn(&[Tensor]) -> Result<Tensor>,
        b: impl Fn(&[Tensor]) -> Result<Tensor>,
    ) -> Result<f64> {
        let vars = inputs.iter().map(candle_core::Var::from_tensor).collect::<Result<Vec<_>>>()?;
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
            let walk = Walk { stride, dilation, pad };
            let inputs = [pattern(&[3, 2, n_frames], 0.0)?, pattern(&[4, 2, kernel], 7.0)?, pattern(&[4], 3.0)?];
            let composed = |v: &[Tensor]| conv1d(&v[0], &v[1], &v[2], walk);
            let off = apart(&inputs, composed, |v| own::conv1d(&v[0], &v[1], &v[2], walk))?;
            assert!(off < 1e-12, "{walk:?} kernel {kernel}: {off:e}");
            assert!(worst(&inputs, composed)? < 1e-7, "{walk:?} kernel {kernel}");
        }
        Ok(())
    }

    #[test]
    fn convolution_of_pictures_has_right_gradients() -> Result<()> {
        for (height, width, [k, l], stride) in
            [(6, 5, [3, 3], 1), (9, 8, [4, 4], 2), (7, 7, [4, 4], 2), (5, 4, [3, 4], 1)]
        {
            let walks = match (k, l) {
                (3, 4) => [Walk::VALID; 2],
                _ => [Walk::same(height, k, stride), Walk::same(width, l, stride)],
            };
            let inputs = [pattern(&[2, 2, height, width], 0.0)?, pattern(&[3, 2, k, l], 7.0)?, pattern(&[3], 3.0)?];
            let error = worst(&inputs, |v| conv2d(&v[0], &v[1], &v[2], walks))?;
            assert!(error < 1e-7, "{height} x {width}, {k} x {l}: {error:e}");
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
