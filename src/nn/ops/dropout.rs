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

#[cfg(test)]
mod tests {
    use super::*;
    use candle_core::{DType, Device};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn a_fraction_is_dropped_and_the_mean_is_preserved() -> Result<()> {
        let x = Tensor::ones((100, 100), DType::F32, &Device::Cpu)?;
        let draw = || dropout(&x, 0.25, &mut Mode::Train(&mut ChaCha8Rng::seed_from_u64(3)))?.flatten_all()?.to_vec1();
        let y: Vec<f32> = draw()?;
        let dropped = y.iter().filter(|v| **v == 0.0).count();
        assert!((2300..2700).contains(&dropped), "{dropped}");
        assert!((y.iter().sum::<f32>() / 1e4 - 1.0).abs() < 0.03);
        assert_eq!(y, draw()?);
        assert_eq!(dropout(&x, 0.25, &mut Mode::Eval)?.sum_all()?.to_scalar::<f32>()?, 1e4);
        Ok(())
    }
}
