//! Unit tests of `orator_gesture::train::gan::average`.

use orator_gesture::train::gan::average::update;
use orator_nn::params::Init;
use orator_nn::params::Params;

#[test]
fn the_average_follows_the_formula() -> anyhow::Result<()> {
    let (mut mean, mut now) = (Params::frozen(), Params::new(1));
    mean.trainable("w", &[3], Init::Constant(0.0))?;
    now.trainable("w", &[3], Init::Constant(2.0))?;
    update(&mean, &now, None, 0.9, 1_000)?;
    assert!((mean.tensors()?["w"].to_vec1::<f32>()?[0] - 0.2).abs() < 1e-6);
    update(&mean, &now, None, 0.9, 0)?;
    // At step 0 the decay is (1 + 0) / (10 + 0) = 0.1: 0.1 x 0.2 + 0.9 x 2.
    assert!((mean.tensors()?["w"].to_vec1::<f32>()?[2] - (0.02 + 1.8)).abs() < 1e-6);
    Ok(())
}
