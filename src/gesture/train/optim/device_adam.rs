//! Adam on a GPU: gradients and moments in one flat tensor each, and one kernel for the norm and one for the update of all
//! tensors. Results equal those of the kernel for the CPU up to rounding; nothing is read from the GPU.

use super::adam::Config;
use candle_core::backprop::GradStore;
use candle_core::{Device, Result, Tensor, Var};
use orator_nn::gpu::gradients::{FlatGradients, backward};
use orator_nn::gpu::launch::{address, run};
use std::sync::Arc;

/// Values per block of the update.
const PART: usize = 8 * 1024;
/// Number of partial sums of the norm.
const N_SUMS: usize = 128;

pub(super) struct DeviceAdam {
    gradients: Arc<FlatGradients>,
    /// First, second and (with AMSGrad) largest second moment, laid out like the gradients.
    moments: Vec<Tensor>,
    /// Address, first position, length and number of the tensor of every part of a tensor.
    parts: Tensor,
    /// Factors of the learning rate and of the weight decay of every tensor.
    factors: Tensor,
    sums: Tensor,
    norm: Tensor,
}

impl DeviceAdam {
    /// Zero moments for tensors on one device, each with the factors of its learning rate and weight decay.
    pub(super) fn new(tensors: Vec<(Var, [f64; 2])>, config: &Config) -> Result<Self> {
        let (vars, factors): (Vec<Var>, Vec<[f64; 2]>) = tensors.into_iter().unzip();
        let gradients = FlatGradients::of(vars)?;
        let flat = gradients.flat();
        let mut parts = Vec::new();
        for (number, (var, start)) in gradients.vars().iter().enumerate() {
            let (address, len) = (address(var)? as i64, var.elem_count());
            for first in (0..len).step_by(PART) {
                let bytes = first * flat.dtype().size_in_bytes();
                let row = [start + first, PART.min(len - first), number].map(|v| v as i64);
                parts.extend([&[address + bytes as i64], &row[..]].concat());
            }
        }
        let decays = |var: &Var| if var.rank() > 1 { config.weight_decay } else { 0.0 };
        let of_tensor = |((var, _), [share, decay]): (&(Var, usize), [f64; 2])| [share, decay * decays(var)];
        let factors: Vec<f64> = gradients.vars().iter().zip(factors).flat_map(of_tensor).collect();
        let n_moments = if config.amsgrad { 3 } else { 2 };
        Ok(Self {
            moments: (0..n_moments).map(|_| flat.zeros_like()).collect::<Result<_>>()?,
            parts: Tensor::new(parts, flat.device())?,
            factors: Tensor::new(factors, flat.device())?.to_dtype(flat.dtype())?,
            sums: Tensor::zeros(N_SUMS, flat.dtype(), flat.device())?,
            norm: Tensor::zeros(1, flat.dtype(), flat.device())?,
            gradients: Arc::new(gradients),
        })
    }

    /// Adds the gradients of `loss` to those of the next update.
    pub(super) fn add_gradients_of(&self, loss: &Tensor) -> Result<()> {
        backward(loss, &self.gradients)
    }

    /// Adds gradients that candle computed to those of the next update.
    pub(super) fn add(&self, gradients: &GradStore) -> Result<()> {
        self.gradients.add(gradients)
    }

    /// Runs update number `age`, counted from 1, and sets the gradients to 0. Writes the gradient norm before clipping to
    /// `norm`, or to a tensor that is returned; if it is not finite, nothing is updated.
    pub(super) fn update(
        &self,
        config: &Config,
        age: u64,
        learning_rate: f64,
        norm: Option<&Tensor>,
    ) -> Result<&Tensor> {
        let (flat, age) = (self.gradients.flat(), age.min(i32::MAX as u64) as i32);
        run("square_sums", &[Some(flat), Some(&self.sums)], &[flat.elem_count()], &[], N_SUMS)?;
        let [first, second, largest] = [0, 1, 2].map(|i| self.moments.get(i));
        let norm = Some(norm.unwrap_or(&self.norm));
        let numbers = [
            config.beta1,
            config.beta2,
            config.eps,
            learning_rate,
            1.0 - config.beta1.powi(age),
            1.0 - config.beta2.powi(age),
            config.max_norm.unwrap_or(f64::INFINITY),
        ];
        let (parts, factors, sums) = (Some(&self.parts), Some(&self.factors), Some(&self.sums));
        let tensors = [parts, factors, sums, Some(flat), first, second, largest, norm];
        run("adam", &tensors, &[N_SUMS], &numbers, self.parts.elem_count() / 4)?;
        Ok(&self.norm)
    }

    /// Copies of the moments of tensor `number` on the CPU, in the order of `kinds`.
    pub(super) fn moments(&self, number: usize) -> Result<Vec<Tensor>> {
        let (var, start) = &self.gradients.vars()[number];
        let part = |moments: &Tensor| moments.narrow(0, *start, var.elem_count())?.reshape(var.shape());
        self.moments.iter().map(|moments| part(moments)?.copy()?.to_device(&Device::Cpu)).collect()
    }

    /// Sets the moments of tensor `number` to these values.
    pub(super) fn set_moments(&self, number: usize, values: Vec<Vec<f32>>) -> Result<()> {
        let (var, start) = &self.gradients.vars()[number];
        for (moments, values) in self.moments.iter().zip(values) {
            let values = Tensor::from_vec(values, var.elem_count(), moments.device())?;
            moments.slice_set(&values.to_dtype(moments.dtype())?, 0, *start)?;
        }
        Ok(())
    }
}
