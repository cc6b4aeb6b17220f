//! Exponential mean of a network's numbers over the steps (Polyak & Juditsky 1992; Tarvainen & Valpola 2017): it moves
//! less than the last step's, and is what is validated and generates.

use candle_core::{CpuStorage, InplaceOp2, Layout, Result};
use orator_nn::cpu::thread_team::parallel_for;
use orator_nn::params::Params;
use std::sync::Mutex;

/// Numbers one task updates.
const GRAIN: usize = 32 * 1024;

/// Moves each tensor of `mean` towards that of the same name in `now`: decay x mean + (1 - decay) x now, the decay after
/// `step` steps at most (1 + step) / (10 + step), so that the first weights are soon forgotten.
pub fn update(mean: &Params, now: &Params, decay: f64, step: usize) -> Result<()> {
    let decay = decay.min((1.0 + step as f64) / (10.0 + step as f64));
    for ((_, mean), (_, now)) in mean.all().zip(now.all()) {
        if mean.device().is_cpu() {
            mean.inplace_op2(now.as_tensor(), &TowardsMean(decay as f32))?;
        } else {
            mean.set(&((mean.as_detached_tensor() * decay)? + (now.as_detached_tensor() * (1.0 - decay))?)?)?;
        }
    }
    Ok(())
}

/// a <- decay a + (1 - decay) b.
struct TowardsMean(f32);

impl InplaceOp2 for TowardsMean {
    fn name(&self) -> &'static str {
        "exponential-mean"
    }

    fn cpu_fwd(&self, mean: &mut CpuStorage, layout: &Layout, now: &CpuStorage, now_layout: &Layout) -> Result<()> {
        let CpuStorage::F32(mean) = mean else { candle_core::bail!("a mean of f32 tensors only") };
        let Some((start, end)) = layout.contiguous_offsets() else { candle_core::bail!("mean: variable in pieces") };
        let now = orator_nn::cpu::tensor::slice::<f32>(now, now_layout)?;
        let Self(decay) = *self;
        let pieces = mean[start..end].chunks_mut(GRAIN).zip(now.chunks(GRAIN));
        let pieces: Vec<_> = pieces.map(Mutex::new).collect();
        parallel_for(pieces.len(), |piece| {
            // Every piece is taken once: the lock is free.
            let Ok(mut piece) = pieces[piece].lock() else { return };
            let (mean, now) = &mut *piece;
            mean.iter_mut().zip(now.iter()).for_each(|(mean, now)| *mean = decay * *mean + (1.0 - decay) * now);
        });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orator_nn::params::Init;

    #[test]
    fn it_follows_the_formula() -> anyhow::Result<()> {
        let (mut mean, mut now) = (Params::frozen(), Params::new(1));
        mean.trainable("w", &[3], Init::Constant(0.0))?;
        now.trainable("w", &[3], Init::Constant(2.0))?;
        update(&mean, &now, 0.9, 1_000)?;
        assert!((mean.tensors()?["w"].to_vec1::<f32>()?[0] - 0.2).abs() < 1e-6);
        update(&mean, &now, 0.9, 0)?;
        // (1 + 0) / (10 + 0) of 0.2, the rest of 2.
        assert!((mean.tensors()?["w"].to_vec1::<f32>()?[2] - (0.02 + 1.8)).abs() < 1e-6);
        Ok(())
    }
}
