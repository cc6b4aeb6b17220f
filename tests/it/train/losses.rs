//! Losses of sequence-to-sequence training.

use candle_core::{Device, Result, Tensor};
use orator_dataset::config::Seq2seqSettings;
use orator_gesture::train::seq2seq::losses::{adversarial_settings, continuity_of_poses, total, variance_loss_of_code};
use orator_nn::ops::gradcheck::worst;

#[test]
fn totals_match_hand_computed_values() -> Result<()> {
    // Two poses of two features each: (3, 0), then (0, 4).
    let generated = Tensor::new(&[[[3.0, 0.0], [0.0, 4.0]]], &Device::Cpu)?;
    let real = Tensor::new(&[[[1.0, 0.0], [0.0, 5.0]]], &Device::Cpu)?;
    let near = |loss: Result<Tensor>, expected: f64| -> Result<bool> {
        Ok((loss?.to_scalar::<f64>()? - expected).abs() < 1e-9)
    };
    let settings = Seq2seqSettings::default();
    let code_loss = total(&settings, &generated, &real, None);
    assert!(near(code_loss, 0.75 + 0.01 * 1.75 - 1.75)?);
    let gan_loss = total(
        &adversarial_settings(&settings),
        &generated,
        &real,
        Some(&Tensor::zeros((2, 1), candle_core::DType::F64, &Device::Cpu)?),
    );
    assert!(near(gan_loss, 1.25 + 0.0175 + 0.01 * 2f64.ln())?);
    Ok(())
}

#[test]
fn the_gradient_at_constant_poses_is_finite() -> Result<()> {
    let constant = Tensor::zeros((1, 3, 2), candle_core::DType::F64, &Device::Cpu)?;
    assert!(
        worst(std::slice::from_ref(&constant), |v| variance_loss_of_code(&v[0])? + continuity_of_poses(&v[0])?)?
            .is_finite()
    );
    Ok(())
}
