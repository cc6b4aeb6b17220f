//! Losses of adversarial and of sequence-to-sequence training.

use candle_core::{DType, Device, Result, Tensor};
use ndarray::Array2;
use orator_base::types::skeleton::N_JOINTS;
use orator_dataset::config::{BoneLoss, Seq2seqSettings};
use orator_gesture::generate::normalisation::{N_FEATURES, Normalisation};
use orator_gesture::train::gan::losses::{BoneConstancy, energy, l1, speed, velocity};
use orator_gesture::train::seq2seq::losses::{adversarial_settings, continuity_of_poses, total, variance_loss_of_code};
use orator_test_support::gradcheck::{pattern, worst};

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

fn normal() -> Normalisation {
    let table = |value: f32| Array2::from_shape_fn((N_JOINTS, 3), |(j, k)| value + 0.01 * (j + 2 * k) as f32);
    Normalisation::new(&table(0.1), &table(0.3), vec![0.2; N_JOINTS - 1])
}

#[test]
fn gradients_match_finite_differences() -> Result<()> {
    let shape = [2, 3, 4];
    let (generated, real) = (pattern(&shape, 0.0)?, pattern(&shape, 3.0)?);
    let mask = pattern(&shape, 9.0)?.gt(0.0)?.to_dtype(DType::F64)?;
    assert!(worst(std::slice::from_ref(&generated), |v| l1(&v[0], &real, &mask))? < 1e-7);
    assert!(worst(std::slice::from_ref(&generated), |v| velocity(&v[0], &real, &mask))? < 1e-7);
    let shape = [2, N_FEATURES + 2, 4];
    let (poses, real) = (pattern(&shape, 1.0)?, pattern(&shape, 5.0)?);
    let mask = pattern(&shape, 9.0)?.gt(-0.8)?.to_dtype(DType::F64)?;
    assert!(worst(std::slice::from_ref(&poses), |v| speed(&v[0], &real, &mask))? < 1e-6);
    assert!(worst(&[poses], |v| energy(&v[0], &real, &mask))? < 1e-6);
    Ok(())
}

#[test]
fn masked_elements_are_ignored() -> Result<()> {
    let row = |values: [f64; 4]| Tensor::new(&values, &Device::Cpu);
    let (generated, real) = (row([1.0, 2.0, 3.0, 4.0])?, row([1.0, 4.0, 100.0, 5.0])?);
    let loss = |mask| -> Result<f64> { l1(&generated, &real, &row(mask)?)?.to_scalar() };
    assert_eq!(loss([1.0, 1.0, 0.0, 1.0])?, 1.0);
    assert_eq!(loss([0.0; 4])?, 0.0);
    Ok(())
}

#[test]
fn the_velocity_loss_ignores_masked_differences() -> Result<()> {
    let row = |values: [f64; 3]| Tensor::new(&[[values]], &Device::Cpu);
    // Differences 1, -2 against 0, 3; the second is masked.
    let loss = velocity(&row([1.0, 2.0, 0.0])?, &row([1.0, 1.0, 4.0])?, &row([1.0, 1.0, 0.0])?)?;
    assert_eq!(loss.to_scalar::<f64>()?, 1.0);
    Ok(())
}

#[test]
fn the_speed_loss_ignores_the_direction() -> Result<()> {
    // In `generated` one joint moves by (3, 4, 0); another is masked.
    let moved = |by: &[(usize, f64)]| -> Result<Tensor> {
        let mut numbers = vec![0.0; 2 * (N_FEATURES + 1)];
        by.iter().for_each(|(number, value)| numbers[2 * number + 1] = *value);
        Tensor::from_vec(numbers, (1, N_FEATURES + 1, 2), &Device::Cpu)
    };
    let generated = moved(&[(0, 3.0), (1, 4.0), (6, 9.0), (N_FEATURES, 9.0)])?;
    let seen = (moved(&[(7, -1.0)])? + 1.0)?;
    let of = |real: &[(usize, f64)]| -> Result<f64> { speed(&generated, &moved(real)?, &seen)?.to_scalar() };
    let close = |loss: f64, expected: f64| assert!((loss - expected).abs() < 5e-3, "{loss}, expected {expected}");
    close(of(&[(5, 2.0)])?, (25.0 + 4.0) / 4.0);
    close(of(&[(2, 5.0), (5, 2.0)])?, 4.0 / 29.0);
    close(of(&[(2, -5.0)])?, 0.0);
    Ok(())
}

#[test]
fn energy_is_averaged_over_all_windows() -> Result<()> {
    let real = pattern(&[2, N_FEATURES, 5], 0.0)?;
    let of = |generated: &Tensor, mask: &Tensor| -> Result<f64> { energy(generated, &real, mask)?.to_scalar() };
    let all = real.ones_like()?;
    assert!(of(&real, &all)? < 1e-12);
    // Doubled speed is four times the energy; direction and offset do not matter.
    assert!((of(&(&real * 2.0)?, &all)? - 4.0f64.ln()).abs() < 1e-4);
    assert!(of(&(real.neg()? + 3.0)?, &all)? < 1e-9);
    // Swapped windows have the same energy; masked joints are ignored.
    let swapped = Tensor::cat(&[real.narrow(0, 1, 1)?, real.narrow(0, 0, 1)?], 0)?;
    assert!(of(&swapped, &all)? < 1e-9);
    let hidden = Tensor::cat(&[all.narrow(1, 0, 3)?.zeros_like()?, all.narrow(1, 3, N_FEATURES - 3)?], 1)?;
    let wild = Tensor::cat(&[(real.narrow(1, 0, 3)? * 9.0)?, real.narrow(1, 3, N_FEATURES - 3)?], 1)?;
    assert!(of(&wild, &hidden)? < 1e-12 && of(&wild, &all)? > 0.05);
    Ok(())
}

#[test]
fn only_changing_bone_lengths_are_penalised() -> Result<()> {
    let bones = BoneConstancy::new(&normal(), BoneLoss::Relative, DType::F64, &Device::Cpu)?;
    let constant = pattern(&[1, N_FEATURES, 1], 0.0)?.broadcast_as((1, N_FEATURES, 5))?.contiguous()?;
    assert!(bones.loss(&constant)?.to_scalar::<f64>()? < 1e-12);
    let moving = pattern(&[1, N_FEATURES, 5], 0.0)?;
    let loss = bones.loss(&moving)?.to_scalar::<f64>()?;
    let with_channels = Tensor::cat(&[&moving, &pattern(&[1, 6, 5], 7.0)?], 1)?;
    assert!(loss > 0.01 && loss == bones.loss(&with_channels)?.to_scalar::<f64>()?);
    Ok(())
}
