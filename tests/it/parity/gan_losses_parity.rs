//! The bone length loss (Rebol et al. 2021, eq. 1) and the adversarial losses (eq. 3 and variants) agree with the
//! equations in PyTorch (`fixtures/reference/gan_losses_reference.py`) in values and gradients, in f64 to 1e-10.

use candle_core::{DType, Device, Result, Tensor, Var};
use orator_dataset::config::{AdversarialLoss, BoneLoss};
use orator_gesture::generate::normalisation::{N_FEATURES, Normalisation};
use orator_gesture::train::gan::losses::{BoneConstancy, discriminator_loss, generator_loss};
use orator_test_support::gradcheck::pattern;
use std::collections::BTreeMap;

#[derive(serde::Deserialize)]
struct Golden {
    /// By form of the loss.
    bones: BTreeMap<String, Derived>,
    /// Loss in metres of two poses, in the second of which only this joint is not at the neck; joints 1 to 48.
    displaced: Vec<f64>,
    scores: BTreeMap<String, Scores>,
}

/// Value of a loss, and its gradients by input.
#[derive(serde::Deserialize)]
struct Derived {
    loss: f64,
    gradients: BTreeMap<String, Vec<f64>>,
}

#[derive(serde::Deserialize)]
struct Scores {
    real: Vec<f64>,
    generated: Vec<f64>,
    losses: BTreeMap<String, Players>,
}

#[derive(serde::Deserialize)]
struct Players {
    discriminator: Derived,
    generator: Derived,
}

fn golden() -> Golden {
    serde_json::from_str(include_str!("../../../fixtures/reference/gan_losses_golden.json")).unwrap()
}

/// Fails if a value differs by more than 1e-10 of the expected one, or of `floor` if that is larger.
fn agree(label: &str, found: &Tensor, expected: &[f64], floor: f64) -> Result<()> {
    let found = found.flatten_all()?.to_vec1::<f64>()?;
    assert_eq!(found.len(), expected.len(), "{label}");
    for (i, (found, expected)) in found.iter().zip(expected).enumerate() {
        let limit = 1e-10 * expected.abs().max(floor);
        assert!((found - expected).abs() <= limit, "{label}, value {i}: {found:e}, expected {expected:e}");
    }
    Ok(())
}

/// Multiples of 1/1024, which are identical in the reference; as f32 they are exact.
fn rounded(shape: &[usize], phase: f64) -> Result<Tensor> {
    (pattern(shape, phase)? * 1024.0)?.round()? / 1024.0
}

fn table(n: usize, phase: f64, factor: f64, offset: f64) -> Result<Vec<f32>> {
    rounded(&[n], phase)?.affine(factor, offset)?.to_dtype(DType::F32)?.to_vec1()
}

#[test]
fn the_bone_loss_agrees_with_equation_1() -> anyhow::Result<()> {
    let normal = Normalisation {
        mean: table(N_FEATURES, 2.0, 0.25, 0.0)?,
        std: table(N_FEATURES, 3.0, 0.0625, 0.125)?,
        bone_lengths: table(N_FEATURES / 3, 4.0, 0.0625, 0.125)?,
        channels: Vec::new(),
    };
    let golden = golden();
    assert_eq!(golden.bones.len(), 2);
    for (form, name) in [(BoneLoss::Metres, "metres"), (BoneLoss::Relative, "relative")] {
        let expected = &golden.bones[name];
        let poses = Var::from_tensor(&rounded(&[2, N_FEATURES, 4], 1.0)?.affine(2.0, 0.0)?)?;
        let loss = BoneConstancy::new(&normal, form, DType::F64, &Device::Cpu)?.loss(&poses)?;
        agree(name, &loss, &[expected.loss], 0.0)?;
        let gradients = loss.backward()?;
        let expected = &expected.gradients["poses"];
        let most = expected.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        agree(&format!("gradient of {name}"), gradients.get(&poses).unwrap(), expected, most)?;
    }
    Ok(())
}

#[test]
fn a_displaced_joint_changes_the_bones_that_meet_there() -> anyhow::Result<()> {
    let normal = Normalisation {
        mean: vec![0.0; N_FEATURES],
        std: vec![1.0; N_FEATURES],
        bone_lengths: vec![0.25; N_FEATURES / 3],
        channels: Vec::new(),
    };
    let bones = BoneConstancy::new(&normal, BoneLoss::Metres, DType::F64, &Device::Cpu)?;
    let golden = golden().displaced;
    assert_eq!(golden.len(), N_FEATURES / 3);
    for (joint, expected) in (1usize..).zip(&golden) {
        let mut values = vec![0.0; 2 * N_FEATURES];
        values[2 * (3 * (joint - 1) + joint % 3) + 1] = 0.0625;
        let poses = Tensor::from_vec(values, (1, N_FEATURES, 2), &Device::Cpu)?;
        agree(&format!("joint {joint}"), &bones.loss(&poses)?, &[*expected], 1e-5)?;
    }
    Ok(())
}

#[test]
fn the_adversarial_losses_agree_with_equation_3_and_its_variants() -> anyhow::Result<()> {
    let all = [
        (AdversarialLoss::LeastSquares, "least-squares"),
        (AdversarialLoss::Log, "log"),
        (AdversarialLoss::Minimax, "minimax"),
    ];
    let golden = golden();
    assert_eq!(golden.scores.len(), 4);
    for (range, scores) in &golden.scores {
        let var = |values: &[f64]| Var::from_tensor(&Tensor::new(values, &Device::Cpu)?.reshape((1, 1, ()))?);
        let (real, generated) = (var(&scores.real)?, var(&scores.generated)?);
        assert_eq!(scores.losses.len(), all.len());
        for (loss, name) in all {
            let expected = &scores.losses[name];
            let of_discriminator = discriminator_loss(loss, &real, &generated)?;
            let of_generator = generator_loss(loss, &generated)?;
            for (player, found, expected) in [
                ("discriminator", of_discriminator, &expected.discriminator),
                ("generator", of_generator, &expected.generator),
            ] {
                let label = format!("{range} scores, {name}, {player}");
                // Near 0 a loss is exact to the rounding of 1.
                agree(&label, &found, &[expected.loss], 1e-5)?;
                let gradients = found.backward()?;
                assert_eq!(expected.gradients.contains_key("real"), player == "discriminator");
                for (input, expected) in &expected.gradients {
                    let var = if input == "real" { &real } else { &generated };
                    agree(&format!("{label}, gradient of {input}"), gradients.get(var).unwrap(), expected, 0.0)?;
                }
            }
        }
    }
    Ok(())
}
