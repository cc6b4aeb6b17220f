//! Adam update composed of candle operators, for tensors that are not on the CPU. Its results equal those of the fused
//! kernel up to rounding; it reads the memory several times instead of once.

use candle_core::{Device, Result, Tensor, Var};

/// First moment, second moment and (with AMSGrad) largest second moment of a parameter, with its shape and device.
pub struct DeviceMoments {
    first: Tensor,
    second: Tensor,
    largest: Option<Tensor>,
}

impl DeviceMoments {
    pub fn zeros(like: &Tensor, amsgrad: bool) -> Result<Self> {
        let largest = if amsgrad { Some(like.zeros_like()?.detach()) } else { None };
        Ok(Self { first: like.zeros_like()?.detach(), second: like.zeros_like()?.detach(), largest })
    }

    /// CPU copies of the moments by kind, for a checkpoint.
    pub fn tensors(&self) -> Result<Vec<(&'static str, Tensor)>> {
        let kinds = [("first", Some(&self.first)), ("second", Some(&self.second)), ("largest", self.largest.as_ref())];
        let there = kinds.into_iter().filter_map(|(kind, tensor)| Some((kind, tensor?)));
        there.map(|(kind, tensor)| Ok((kind, tensor.to_device(&Device::Cpu)?))).collect()
    }

    /// Restores the moments saved by `tensors`; `of_kind` returns the values of a kind, given their number.
    pub fn load(&mut self, mut of_kind: impl FnMut(&str, usize) -> anyhow::Result<Vec<f32>>) -> anyhow::Result<()> {
        let (shape, device) = (self.first.shape().clone(), self.first.device().clone());
        let mut read = |kind: &str| -> anyhow::Result<Tensor> {
            Ok(Tensor::from_vec(of_kind(kind, shape.elem_count())?, &shape, &device)?)
        };
        let largest = if self.largest.is_some() { Some(read("largest")?) } else { None };
        *self = Self { first: read("first")?, second: read("second")?, largest };
        Ok(())
    }

    pub fn update(&mut self, var: &Var, grad: &Tensor, scalars: &AdamScalars) -> Result<()> {
        let AdamScalars { beta1, beta2, eps, scale, rate, correction, keep } = *scalars;
        let of = f64::from;
        let grad = (grad.detach() * of(scale))?;
        self.first = ((&self.first * of(beta1))? + (&grad * of(1.0 - beta1))?)?;
        self.second = ((&self.second * of(beta2))? + (grad.sqr()? * of(1.0 - beta2))?)?;
        let spread = match &mut self.largest {
            Some(largest) => {
                *largest = largest.maximum(&self.second)?;
                &*largest
            }
            None => &self.second,
        };
        let step = ((&self.first * of(rate))? / (spread.sqrt()? * of(correction))?.affine(1.0, of(eps))?)?;
        var.set(&((var.as_detached_tensor() * of(keep))? - step)?)
    }
}

pub fn sum_of_squares(grad: &Tensor) -> Result<f64> {
    grad.sqr()?.sum_all()?.to_scalar::<f32>().map(f64::from)
}

#[derive(Clone, Copy)]
pub struct AdamScalars {
    pub beta1: f32,
    pub beta2: f32,
    pub eps: f32,
    /// Factor that clips the gradients.
    pub scale: f32,
    /// Learning rate divided by the bias correction of the first moment.
    pub rate: f32,
    /// Square root of the inverse bias correction of the second moment.
    pub correction: f32,
    /// Factor of the weights that applies the weight decay.
    pub keep: f32,
}
