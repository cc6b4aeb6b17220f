//! Changing the number of frames: twice as many by repetition, any number by linear interpolation.

use super::cpu::{Real, is_f64, read, slice};
use candle_core::backend::BackendStorage;
use candle_core::{CpuStorage, CustomOp1, Device, Layout, Result, Shape, Tensor};

/// Every frame twice: [B, C, T] to [B, C, 2T]. An own operator: the stock one overwrites the gradient where `x` is
/// used again.
pub fn twice(x: &Tensor) -> Result<Tensor> {
    x.contiguous()?.apply_op1(Twice)
}

struct Twice;

impl CustomOp1 for Twice {
    fn name(&self) -> &'static str {
        "every frame twice"
    }

    fn cpu_fwd(&self, x: &CpuStorage, layout: &Layout) -> Result<(CpuStorage, Shape)> {
        fn repeat<T: Real>(x: &[T]) -> Vec<T> {
            x.iter().flat_map(|v| [*v, *v]).collect()
        }
        let (batch, channels, n_frames) = layout.shape().dims3()?;
        let y = if is_f64(x.dtype())? {
            CpuStorage::F64(repeat(slice(x, layout)?))
        } else {
            CpuStorage::F32(repeat(slice(x, layout)?))
        };
        Ok((y, Shape::from((batch, channels, 2 * n_frames))))
    }

    fn bwd(&self, x: &Tensor, _y: &Tensor, grad: &Tensor) -> Result<Option<Tensor>> {
        fn typed<T: Real>(grad: &Tensor) -> Result<Vec<T>> {
            read::<T, _>(grad, |grad| Ok(grad.as_chunks::<2>().0.iter().map(|[a, b]| *a + *b).collect()))
        }
        Ok(Some(if is_f64(grad.dtype())? {
            Tensor::from_vec(typed::<f64>(grad)?, x.shape(), x.device())?
        } else {
            Tensor::from_vec(typed::<f32>(grad)?, x.shape(), x.device())?
        }))
    }
}

/// Linear interpolation to `n_out` frames, [B, C, T] to [B, C, n_out], as TensorFlow 1 does without aligned corners:
/// frame i of the result lies at i * T / n_out, the last frame is held.
pub fn linear(x: &Tensor, n_out: usize) -> Result<Tensor> {
    let n_in = x.dim(2)?;
    if n_in == n_out {
        return Ok(x.clone());
    }
    if n_in == 0 {
        candle_core::bail!("nothing to interpolate: a sequence of no frames");
    }
    let at = |i: usize| i as f64 * n_in as f64 / n_out as f64;
    let (mut before, mut after, mut share) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..n_out {
        let floor = (at(i) as usize).min(n_in - 1);
        before.push(floor as u32);
        after.push((floor + 1).min(n_in - 1) as u32);
        share.push(at(i) - floor as f64);
    }
    let indices = |values: Vec<u32>| Tensor::new(values, &Device::Cpu);
    let (before, after) = (x.index_select(&indices(before)?, 2)?, x.index_select(&indices(after)?, 2)?);
    let share = Tensor::new(share, &Device::Cpu)?.to_dtype(x.dtype())?;
    &before + (after - &before)?.broadcast_mul(&share)?
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nn::finite_difference::{pattern, worst};

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
        assert_eq!(twice(&x)?.flatten_all()?.to_vec1::<f64>()?, [0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0]);
        Ok(())
    }
}
