//! Gradients of the parameters of a network in one flat tensor. Operations of `layer` add theirs during a backward pass, so
//! that candle neither allocates nor adds up a tensor per parameter; those of other operations are added afterwards.

use super::launch::{blocks, executor, run};
use crate::params::Params;
use candle_core::backprop::GradStore;
use candle_core::{DType, Result, Tensor, TensorId, Var};
use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::Arc;

/// Values between the starts of two tensors are a multiple of this, because cuDNN needs aligned addresses.
const ALIGNMENT: usize = 64;

/// Flat tensor with a slot per parameter; its gradients are 0 before a backward pass.
pub struct FlatGradients {
    flat: Tensor,
    vars: Vec<(Var, usize)>,
    slots: HashMap<TensorId, Tensor>,
}

thread_local!(static CURRENT: RefCell<Option<Arc<FlatGradients>>> = const { RefCell::new(None) });

impl FlatGradients {
    /// Zero gradients for every trainable tensor, in their order.
    pub fn new(params: &Params) -> Result<Self> {
        Self::of(params.trainables().map(|(_, var)| var.clone()).collect())
    }

    /// Zero gradients for these tensors of one device and type, in their order.
    pub fn of(vars: Vec<Var>) -> Result<Self> {
        let mut n = 0;
        let mut starts = Vec::new();
        for var in vars {
            let start = n;
            n += var.elem_count().next_multiple_of(ALIGNMENT);
            starts.push((var, start));
        }
        let Some((first, _)) = starts.first() else { candle_core::bail!("no tensor to train") };
        let flat = Tensor::zeros(n, first.dtype(), first.device())?;
        let slot = |(var, start): &(Var, usize)| {
            Ok((var.id(), flat.narrow(0, *start, var.elem_count())?.reshape(var.shape())?))
        };
        Ok(Self { slots: starts.iter().map(slot).collect::<Result<_>>()?, vars: starts, flat })
    }

    /// All gradients, in the order of the tensors, with gaps of zeros.
    pub fn flat(&self) -> &Tensor {
        &self.flat
    }

    /// Tensors with the start of their gradients in [`Self::flat`].
    pub fn vars(&self) -> &[(Var, usize)] {
        &self.vars
    }

    /// Gradient of a tensor; `None`: it is not one of this set.
    pub fn get(&self, tensor: &Tensor) -> Option<&Tensor> {
        self.slots.get(&tensor.id())
    }

    /// Adds gradients that candle computed.
    pub fn add(&self, gradients: &GradStore) -> Result<()> {
        for (var, _) in &self.vars {
            if let (Some(slot), Some(gradient)) = (self.get(var), gradients.get(var)) {
                accumulate(slot, gradient)?;
            }
        }
        Ok(())
    }
}

/// Gradient of a parameter to which the running backward pass adds; `None`: it is not wanted.
pub(super) fn slot(parameter: &Tensor) -> Option<Tensor> {
    CURRENT.with_borrow(|current| current.as_ref()?.get(parameter).cloned())
}

/// Adds the gradients of `loss` to `gradients`; those of other parameters are not computed.
pub fn backward(loss: &Tensor, gradients: &Arc<FlatGradients>) -> Result<()> {
    if let Some(executor) = executor() {
        executor.note_graph(loss.sorted_nodes().len());
    }
    CURRENT.set(Some(gradients.clone()));
    let computed = loss.backward();
    CURRENT.set(None);
    gradients.add(&computed?)
}

/// sum += x
pub(super) fn accumulate(sum: &Tensor, x: &Tensor) -> Result<()> {
    let x = x.contiguous()?.to_dtype(if sum.dtype() == DType::F64 { DType::F64 } else { DType::F32 })?;
    run("accumulate", &[Some(sum), Some(&x)], &[x.elem_count()], &[], blocks(x.elem_count()))
}
