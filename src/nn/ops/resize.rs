//! Changing the number of frames: twice as many by repetition, any number by linear interpolation.

use candle_core::{Result, Tensor};
use std::ops::Range;

/// Every frame twice: [B, T, C] to [B, 2T, C]. By index: the stock resize overwrites the gradient where `x` is used again.
pub fn twice(x: &Tensor) -> Result<Tensor> {
    let frames = Tensor::from_iter((0..2 * x.dim(1)? as u32).map(|i| i / 2), x.device())?;
    x.contiguous()?.index_select(&frames, 1)
}

/// Linear interpolation to `n_out` frames, [B, C, T] to [B, C, n_out], as TensorFlow 1 does without aligned corners:
/// frame i of the result lies at i * T / n_out, the last frame is held.
pub fn linear(x: &Tensor, n_out: usize) -> Result<Tensor> {
    let n_in = x.dim(2)?;
    if n_in == n_out {
        return Ok(x.clone());
    }
    let part = ResizedPart { frames: 0..n_out, n_in, n_out };
    linear_part(&x.narrow(2, 0, part.needed().end)?, &part)
}

/// Some frames of a linear interpolation of `n_in` frames to `n_out`.
pub struct ResizedPart {
    pub frames: Range<usize>,
    pub n_in: usize,
    pub n_out: usize,
}

impl ResizedPart {
    /// The frame at or before the place of frame `i` of the result, and the way from it to the next.
    fn place(&self, i: usize) -> (usize, f64) {
        let at = i as f64 * self.n_in as f64 / self.n_out as f64;
        let before = (at as usize).min(self.n_in.saturating_sub(1));
        (before, at - before as f64)
    }

    /// The frames that go in.
    pub fn needed(&self) -> Range<usize> {
        let last = self.place(self.frames.end.saturating_sub(1)).0;
        self.place(self.frames.start).0..(last + 2).min(self.n_in)
    }
}

/// A part of what [`linear`] makes, from the frames that it needs, [B, C, `part.needed()`].
pub fn linear_part(x: &Tensor, part: &ResizedPart) -> Result<Tensor> {
    let needed = part.needed();
    if x.dim(2)? != needed.len() || needed.is_empty() || part.frames.is_empty() {
        candle_core::bail!("cannot interpolate frames {:?} from {} of {needed:?}", part.frames, x.dim(2)?);
    }
    let places = part.frames.clone().map(|i| part.place(i));
    let before: Vec<u32> = places.clone().map(|(before, _)| (before - needed.start) as u32).collect();
    let after: Vec<u32> = before.iter().map(|before| (before + 1).min(needed.len() as u32 - 1)).collect();
    let share: Vec<f64> = places.map(|(_, share)| share).collect();
    let x = x.contiguous()?;
    let select = |indices: Vec<u32>| x.index_select(&Tensor::new(indices, x.device())?, 2);
    let (before, after) = (select(before)?, select(after)?);
    let share = Tensor::new(share, x.device())?.to_dtype(x.dtype())?;
    &before + (after - &before)?.broadcast_mul(&share)?
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nn::ops::gradcheck::{pattern, worst};
    use candle_core::Device;

    #[test]
    fn gradients_are_right_also_where_the_input_is_used_again() -> Result<()> {
        let x = pattern(&[2, 3, 5], 0.0)?;
        for n_out in [3, 5, 7, 11] {
            assert!(worst(std::slice::from_ref(&x), |v| linear(&v[0].sqr()?, n_out))? < 1e-7);
        }
        let skip = |v: &[Tensor]| {
            let early = v[0].sqr()?;
            twice(&early)? * twice(&early.sin()?)? + twice(&early)?
        };
        assert!(worst(&[x], skip)? < 1e-7);
        Ok(())
    }

    #[test]
    fn positions_are_tensorflows() -> Result<()> {
        let x = Tensor::new(&[[[0.0f64, 1.0, 2.0, 3.0]]], &Device::Cpu)?;
        let at = |n_out| linear(&x, n_out)?.flatten_all()?.to_vec1::<f64>();
        assert_eq!(at(8)?, [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.0]);
        assert_eq!(at(2)?, [0.0, 2.0]);
        let part = ResizedPart { frames: 3..6, n_in: 4, n_out: 8 };
        assert_eq!(part.needed(), 1..4);
        let some = linear_part(&x.narrow(2, 1, 3)?, &part)?.flatten_all()?.to_vec1::<f64>()?;
        assert_eq!(some, [1.5, 2.0, 2.5]);
        assert!(linear_part(&x, &part).is_err());
        assert_eq!(twice(&x.t()?)?.flatten_all()?.to_vec1::<f64>()?, [0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0]);
        Ok(())
    }
}
