//! Training mode, and dropout with masks from a seeded generator (candle's dropout cannot be seeded on the CPU).

use candle_core::{Result, Tensor};
use rand::Rng;

/// Mode of a forward pass: training (batch statistics, dropout masks from the generator) or evaluation.
pub enum Mode<'a> {
    Train(&'a mut rand_chacha::ChaCha8Rng),
    Eval,
}

impl Mode<'_> {
    pub fn trains(&self) -> bool {
        matches!(self, Mode::Train(_))
    }
}

/// In training, zeroes each value with probability `p` and scales the others by 1 / (1 - p).
pub fn dropout(x: &Tensor, p: f64, mode: &mut Mode) -> Result<Tensor> {
    match mode {
        Mode::Train(rng) if p > 0.0 => {
            let threshold = (p * f64::from(u32::MAX)) as u32;
            let scale = 1.0 / (1.0 - p);
            let mask: Vec<f32> =
                (0..x.elem_count()).map(|_| if rng.random::<u32>() < threshold { 0.0 } else { scale as f32 }).collect();
            x * Tensor::from_vec(mask, x.shape(), x.device())?.to_dtype(x.dtype())?
        }
        _ => Ok(x.clone()),
    }
}
