//! Resizing over time, channels last: doubling by repetition, and linear interpolation to any number of frames; and
//! transposition from channels first to channels last.

use super::operator::{CpuOperator, CustomOperator, Gradients, Operand};
use crate::cpu::frames::{FrameInterpolation, transpose};
use crate::cpu::tensor::Scalar;
use crate::gpu::frames;
use crate::gpu::launch::is_on_device;
use candle_core::{Result, Shape, Tensor};
use std::ops::Range;

/// Repeats every frame of `x` [B, T, C] twice and adds `skip` [B, 2T, C]. With `is_delayed`, the repeated frames come one
/// frame later, after zeros, so that none precedes the second of the two frames that it was computed from.
pub fn repeat_frames_and_add(x: &Tensor, skip: &Tensor, is_delayed: bool) -> Result<Tensor> {
    let (n_out, delay) = (2 * x.dim(1)?, usize::from(is_delayed));
    let x = if is_delayed { x.pad_with_zeros(1, 1, 0)? } else { x.clone() };
    let source = |i: usize| ((i + delay) / 2, (i + delay) / 2, 0.0);
    mix(&x, Some(skip), FrameInterpolation { n_in: x.dim(1)?, of: (0..n_out).map(source).collect() })
}

/// Interpolates linearly to `n_out` frames, [B, T, C] to [B, n_out, C], like TensorFlow 1 without aligned corners:
/// frame i of the result is at i * T / n_out, and the last frame is repeated.
pub fn linear(x: &Tensor, n_out: usize) -> Result<Tensor> {
    let n_in = x.dim(1)?;
    linear_with_ratio(x, n_out, (n_in, n_out))
}

/// Like [`linear`], with frame i at i * `ratio.0` / `ratio.1`, whatever the number of input frames.
pub fn linear_with_ratio(x: &Tensor, n_out: usize, ratio: (usize, usize)) -> Result<Tensor> {
    let n_in = x.dim(1)?;
    if n_in == n_out && ratio.0 == ratio.1 {
        return Ok(x.clone());
    }
    let part = ResizedPart { ratio, ..ResizedPart::new(0..n_out, n_in, n_out) };
    if is_on_device(x) {
        return frames::interpolate(&x.t()?, &part)?.t();
    }
    linear_part(&x.narrow(1, 0, part.needed().end)?, &part)
}

/// A range of frames of a linear interpolation from `n_in` frames to `n_out`.
#[derive(Clone)]
pub struct ResizedPart {
    pub frames: Range<usize>,
    pub n_in: usize,
    pub n_out: usize,
    /// Input frames per frame of the result, as numerator and denominator.
    pub ratio: (usize, usize),
}

impl ResizedPart {
    pub fn new(frames: Range<usize>, n_in: usize, n_out: usize) -> Self {
        Self { frames, n_in, n_out, ratio: (n_in, n_out) }
    }

    /// The input frame at or before the position of frame `i` of the result, and the fraction of the way to the next.
    fn source(&self, i: usize) -> (usize, f64) {
        let at = i as f64 * self.ratio.0 as f64 / self.ratio.1 as f64;
        let before = (at as usize).min(self.n_in.saturating_sub(1));
        (before, at - before as f64)
    }

    /// Returns the required input frames.
    pub fn needed(&self) -> Range<usize> {
        let last = self.source(self.frames.end.saturating_sub(1)).0;
        self.source(self.frames.start).0..(last + 2).min(self.n_in)
    }
}

/// Computes a part of the result of [`linear`] from the frames that it requires, [B, `part.needed()`, C].
pub fn linear_part(x: &Tensor, part: &ResizedPart) -> Result<Tensor> {
    let needed = part.needed();
    if x.dim(1)? != needed.len() || needed.is_empty() || part.frames.is_empty() {
        candle_core::bail!("cannot interpolate frames {:?} from {} of {needed:?}", part.frames, x.dim(1)?);
    }
    if is_on_device(x) {
        return frames::interpolate(&x.t()?, part)?.t();
    }
    let of = part.frames.clone().map(|i| {
        let (before, share) = part.source(i);
        (before - needed.start, (before - needed.start + 1).min(needed.len() - 1), share)
    });
    mix(x, None, FrameInterpolation { n_in: needed.len(), of: of.collect() })
}

/// Transposes the last two axes of `x`, [B, C, T] to [B, T, C], in memory, or as a view on a GPU.
pub fn transposed(x: &Tensor) -> Result<Tensor> {
    if is_on_device(x) {
        return x.t();
    }
    let none = Tensor::zeros(0, x.dtype(), x.device())?;
    x.contiguous()?.apply_op3(&none, &none, CustomOperator(TransposeOp))
}

/// Frames [B, T, C] mixed from those of `x` as `interpolation` states, with `skip` added.
pub fn mix(x: &Tensor, skip: Option<&Tensor>, interpolation: FrameInterpolation) -> Result<Tensor> {
    let x = x.contiguous()?;
    let skip = skip.map(Tensor::contiguous).transpose()?;
    let none = Tensor::zeros(0, x.dtype(), x.device())?;
    let op = MixOp { interpolation, plus: skip.is_some() };
    x.apply_op3(skip.as_ref().unwrap_or(&none), &none, CustomOperator(op))
}

struct MixOp {
    interpolation: FrameInterpolation,
    /// Whether the second operand is added.
    plus: bool,
}

impl CpuOperator for MixOp {
    const NAME: &'static str = "frame interpolation";

    fn forward<T: Scalar>(&self, [x, skip, _]: [Operand<T>; 3]) -> Result<(Vec<T>, Shape)> {
        let (&[batch, n_in, n_channels], n_out) = (x.dims, self.interpolation.n_out()) else {
            candle_core::bail!("cannot resize shape {:?}: expected [B, T, C]", x.dims);
        };
        if n_in != self.interpolation.n_in || (self.plus && skip.dims != [batch, n_out, n_channels]) {
            candle_core::bail!("cannot resize {:?} to {n_out} frames and add {:?}", x.dims, skip.dims);
        }
        let skip = self.plus.then_some(skip.values);
        Ok((self.interpolation.mix(x.values, skip, n_channels), Shape::from((batch, n_out, n_channels))))
    }

    fn backward<T: Scalar>(&self, [x, skip, _]: [Operand<T>; 3], _: &[T], grad: &[T]) -> Gradients<T> {
        let of_x = x.tracked.then(|| self.interpolation.gradient(grad, x.dims[2]));
        Ok([of_x, (self.plus && skip.tracked).then(|| grad.to_vec()), None])
    }
}

struct TransposeOp;

impl CpuOperator for TransposeOp {
    const NAME: &'static str = "transpose";

    fn forward<T: Scalar>(&self, [x, ..]: [Operand<T>; 3]) -> Result<(Vec<T>, Shape)> {
        let &[batch, rows, columns] = x.dims else {
            candle_core::bail!("cannot transpose shape {:?}: expected [B, rows, columns]", x.dims);
        };
        Ok((transpose(x.values, rows, columns), Shape::from((batch, columns, rows))))
    }

    fn backward<T: Scalar>(&self, [x, ..]: [Operand<T>; 3], _: &[T], grad: &[T]) -> Gradients<T> {
        Ok([x.tracked.then(|| transpose(grad, x.dims[2], x.dims[1])), None, None])
    }
}
