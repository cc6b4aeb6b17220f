//! Exponential moving average (EMA) of the weights over the steps (Polyak & Juditsky 1992; Tarvainen & Valpola 2017).
//! It fluctuates less than the weights of the last step, and is used for validation and generation.

use candle_core::{CpuStorage, InplaceOp2, Layout, Result, Tensor};
use orator_nn::cpu::spin_pool::parallel_for;
use orator_nn::gpu::launch::{address, is_on_device, run};
use orator_nn::params::Params;
use std::sync::Mutex;

/// Elements per task.
const GRAIN: usize = 32 * 1024;

/// Table for [`update`] of tensors on a GPU: both addresses and the length of every part of a tensor; `None` on the CPU.
pub fn parts(mean: &Params, now: &Params) -> Result<Option<Tensor>> {
    let mut parts = Vec::new();
    for ((_, mean), (_, now)) in mean.all().zip(now.all()).filter(|((_, mean), _)| is_on_device(mean)) {
        let (addresses, size) = ([address(mean)?, address(now)?], mean.dtype().size_in_bytes());
        for first in (0..mean.elem_count()).step_by(GRAIN) {
            parts.extend(addresses.map(|address| address as i64 + (first * size) as i64));
            parts.push(GRAIN.min(mean.elem_count() - first) as i64);
        }
    }
    if parts.is_empty() { Ok(None) } else { Tensor::new(parts, mean.device()).map(Some) }
}

/// Updates each tensor of `mean` with the tensor of the same name in `now`: decay x mean + (1 - decay) x now. The decay
/// after `step` steps is at most (1 + step) / (10 + step), so that the initial weights soon lose their influence. `parts`
/// lists tensors on a GPU.
pub fn update(mean: &Params, now: &Params, parts: Option<&Tensor>, decay: f64, step: usize) -> Result<()> {
    let decay = decay.min((1.0 + step as f64) / (10.0 + step as f64));
    if let (Some(parts), Some((_, first))) = (parts, mean.all().next()) {
        return run("average", &[Some(parts), Some(first.as_tensor())], &[], &[decay], parts.elem_count() / 3);
    }
    for ((_, mean), (_, now)) in mean.all().zip(now.all()) {
        mean.inplace_op2(now.as_tensor(), &EmaUpdate(decay as f32))?;
    }
    Ok(())
}

/// In-place operator a <- decay a + (1 - decay) b with the decay as field.
struct EmaUpdate(f32);

impl InplaceOp2 for EmaUpdate {
    fn name(&self) -> &'static str {
        "exponential-mean"
    }

    fn cpu_fwd(&self, mean: &mut CpuStorage, layout: &Layout, now: &CpuStorage, now_layout: &Layout) -> Result<()> {
        let CpuStorage::F32(mean) = mean else { candle_core::bail!("the weight average needs f32 tensors") };
        let Some((start, end)) = layout.contiguous_offsets() else {
            candle_core::bail!("the weight average needs contiguous tensors")
        };
        let now = orator_nn::cpu::tensor::slice::<f32>(now, now_layout)?;
        let Self(decay) = *self;
        let pieces = mean[start..end].chunks_mut(GRAIN).zip(now.chunks(GRAIN));
        let pieces: Vec<_> = pieces.map(Mutex::new).collect();
        parallel_for(pieces.len(), |piece| {
            // Each piece is locked by exactly one task, so the lock is never contended.
            let Ok(mut piece) = pieces[piece].lock() else { return };
            let (mean, now) = &mut *piece;
            mean.iter_mut().zip(now.iter()).for_each(|(mean, now)| *mean = decay * *mean + (1.0 - decay) * now);
        });
        Ok(())
    }
}
