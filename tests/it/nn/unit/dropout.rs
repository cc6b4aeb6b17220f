//! Unit tests of `orator_nn::ops::dropout`.

use candle_core::{DType, Device};
use candle_core::{Result, Tensor};
use orator_nn::ops::dropout::{Mode, dropout};
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
