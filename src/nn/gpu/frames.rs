//! Resizing of frames on a GPU, channels first: linear interpolation as in `ops::resize`, and doubling.

use super::launch::{blocks, result, run};
use super::layer::attached;
use crate::ops::resize::ResizedPart;
use candle_core::{Result, Tensor};

/// Computes a part of a linear interpolation of `x` [B, C, T], its `part.needed()` frames or all; only a complete one has a
/// gradient.
pub fn interpolate(x: &Tensor, part: &ResizedPart) -> Result<Tensor> {
    let ((batch, channels, n), input) = (x.dims3()?, x.detach().contiguous()?);
    let ResizedPart { frames, n_in, n_out, ratio } = part.clone();
    let (rows, needed) = (batch * channels, if n == n_in { 0 } else { part.needed().start });
    let y = result((batch, channels, frames.len()), &input)?;
    let ints = [rows, n, frames.len(), n_in, ratio.0, ratio.1, frames.start, needed];
    run("interpolate_forward", &[Some(&input), Some(&y)], &ints, &[], blocks(y.elem_count()))?;
    attached(y, x, x, move |grad| {
        if frames != (0..n_out) {
            candle_core::bail!("a part of an interpolation has no gradient");
        }
        let grad_x = result((batch, channels, n_in), grad)?;
        let tensors = [Some(&grad.contiguous()?), Some(&grad_x)];
        run(
            "interpolate_backward",
            &tensors,
            &[rows, n_in, n_out, ratio.0, ratio.1],
            &[],
            blocks(grad_x.elem_count()),
        )?;
        Ok(Some(grad_x))
    })
}

/// Repeats every frame of `x` [B, C, 1, T] twice, `delay` frames later (0 or 1), and adds `skip` [B, C, 1, 2T].
pub(super) fn repeat_and_add(x: &Tensor, skip: &Tensor, delay: usize) -> Result<Tensor> {
    let y = result(skip.shape(), skip)?;
    let (n, n_frames) = (y.elem_count(), y.dim(3)?);
    if 2 * x.elem_count() != n {
        candle_core::bail!("cannot repeat the frames of {:?} to add {:?}", x.dims(), skip.dims());
    }
    run("repeat_and_add", &[Some(x), Some(skip), Some(&y)], &[n, n_frames, delay], &[], blocks(n))?;
    Ok(y)
}

/// Gradient of the repeated frames, [B, C, 1, 2T] to [B, C, 1, T].
pub(super) fn repeat_backward(grad: &Tensor, delay: usize) -> Result<Tensor> {
    let (batch, channels, height, n) = grad.dims4()?;
    let y = result((batch, channels, height, n / 2), grad)?;
    run("repeat_backward", &[Some(grad), Some(&y)], &[y.elem_count(), n, delay], &[], blocks(y.elem_count()))?;
    Ok(y)
}
