//! The update of Adam made of the framework's operators, for tensors that are not on the CPU: the same numbers but for
//! rounding, several passes over the memory instead of one.

use candle_core::{Device, Result, Tensor, Var};

/// First moment, second moment, largest second moment (with AMSGrad), each of the tensor's shape and on its device.
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

    /// By kind, on the CPU, to save.
    pub fn tensors(&self) -> Result<Vec<(&'static str, Tensor)>> {
        let kinds = [("first", Some(&self.first)), ("second", Some(&self.second)), ("largest", self.largest.as_ref())];
        let there = kinds.into_iter().filter_map(|(kind, tensor)| Some((kind, tensor?)));
        there.map(|(kind, tensor)| Ok((kind, tensor.to_device(&Device::Cpu)?))).collect()
    }

    /// Takes up where `tensors` left off; `of_kind` gives the numbers of a kind.
    pub fn load(&mut self, mut of_kind: impl FnMut(&str, usize) -> anyhow::Result<Vec<f32>>) -> anyhow::Result<()> {
        let (shape, device) = (self.first.shape().clone(), self.first.device().clone());
        let mut read = |kind: &str| -> anyhow::Result<Tensor> {
            Ok(Tensor::from_vec(of_kind(kind, shape.elem_count())?, &shape, &device)?)
        };
        let largest = if self.largest.is_some() { Some(read("largest")?) } else { None };
        *self = Self { first: read("first")?, second: read("second")?, largest };
        Ok(())
    }

    /// Moves `var` against `grad`.
    pub fn update(&mut self, var: &Var, grad: &Tensor, numbers: &AdamScalars) -> Result<()> {
        let AdamScalars { beta1, beta2, eps, scale, rate, correction, keep } = *numbers;
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

/// The sum of the squares of a gradient.
pub fn sum_of_squares(grad: &Tensor) -> Result<f64> {
    grad.sqr()?.sum_all()?.to_scalar::<f32>().map(f64::from)
}

/// The numbers of one update.
#[derive(Clone, Copy)]
pub struct AdamScalars {
    pub beta1: f32,
    pub beta2: f32,
    pub eps: f32,
    /// What gradients are multiplied with, to clip them.
    pub scale: f32,
    /// Learning rate over the first moment's bias correction.
    pub rate: f32,
    /// Square root of the second moment's bias correction.
    pub correction: f32,
    /// What is left of the weights by their decay.
    pub keep: f32,
}
