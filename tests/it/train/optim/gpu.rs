//! Training steps with the kernels of a GPU, compiled for the CPU, agree with those of the CPU.

use crate::fixtures::gpu_shim::GpuShim;
use anyhow::Result;
use candle_core::{Device, Tensor};
use ndarray::Array2;
use orator_base::types::skeleton::{N_BONES, N_JOINTS, is_duplicate};
use orator_base::types::time::FrameRate;
use orator_dataset::config::{AdversarialLoss, GanConfig, GanSettings, NetworkPreset};
use orator_formats::checkpoint;
use orator_gesture::generate::model::SpeakerMetadata;
use orator_gesture::generate::normalisation::{N_FEATURES, Normalisation};
use orator_gesture::generate::representation::Representation;
use orator_gesture::train::gan::recipe::{self, InitialWeights, TrainingMaterial};
use orator_gesture::train::gan::step::{GanTrainer, Losses, StepBatch, TrainerState};
use orator_gesture::train::gan::windows::WindowBatch;
use orator_gesture::train::optim::adam::{self, Adam};
use orator_nn::gan::generator::{Config, Preset};
use orator_nn::gan::words::{N_TIMES, WordFrames};
use orator_nn::params::{Init, Params};
use orator_nn::weights::Contents;
use orator_test_support::gradcheck::pattern;
use std::path::Path;

const N_FRAMES: usize = 64;
const N_MELS: usize = 427;
const BATCH: usize = 4;

/// The settings that the recipe `auto` gives ten minutes of speech, with these changes.
fn settings(change: impl Fn(&mut GanSettings)) -> GanSettings {
    let material = TrainingMaterial { train_secs: 600.0, validation_secs: 60.0, n_speakers: 1 };
    let requested = GanConfig { window_frames: N_FRAMES, batch: BATCH.into(), ..GanConfig::default() };
    let mut settings = recipe::settings(&requested, &material, InitialWeights::Random).unwrap();
    change(&mut settings);
    settings
}

/// Speakers of one small network.
fn speakers(settings: &GanSettings, n: usize, vocabulary: usize) -> Vec<SpeakerMetadata> {
    let table = |value: f32| Array2::from_shape_fn((N_JOINTS, 3), |(j, k)| value + 0.01 * (j + 2 * k) as f32);
    let length = |joint: usize| if is_duplicate(joint) { 0.0 } else { 0.05 + 0.002 * joint as f32 };
    let preset = if settings.preset == NetworkPreset::Paper { Preset::Paper } else { Preset::Light };
    let plain =
        Config { width: if preset == Preset::Paper { 8 } else { 16 }, ..Config::from_preset(preset, N_FEATURES) };
    let n_speakers = if n > 1 { n } else { 0 };
    let network = Config { vocabulary, word: 3, n_speakers, speaker_weights: n > 1, ..plain };
    let speaker = |i: usize| {
        let lengths = (1..N_JOINTS).map(length).collect();
        let normal = Normalisation::new(&table(0.1 * i as f32), &table(0.3), lengths);
        let bones = Representation::Bones { mean: vec![0.1; 3 * N_BONES], std: vec![0.4; 3 * N_BONES] };
        let is_bones = settings.representation != orator_dataset::config::MotionRepresentation::Positions;
        let representation = if is_bones { bones } else { Representation::Positions };
        SpeakerMetadata::new(&format!("host {i}"), FrameRate::new(15, 1), "", network.clone(), normal, representation)
    };
    (0..n).map(speaker).collect()
}

/// Windows whose poses follow the sound; some joints are hidden.
fn windows(n_speakers: usize, has_words: bool, step: usize) -> Result<WindowBatch> {
    let phase = 100.0 * step as f64;
    let tensor = |shape: [usize; 3], phase: f64| pattern(&shape, phase)?.to_dtype(candle_core::DType::F32);
    let mask =
        tensor([BATCH, N_FEATURES / 3, N_FRAMES], phase + 1.0)?.gt(-0.8f32)?.to_dtype(candle_core::DType::F32)?;
    let mask = mask
        .unsqueeze(2)?
        .broadcast_as((BATCH, N_FEATURES / 3, 3, N_FRAMES))?
        .reshape((BATCH, N_FEATURES, N_FRAMES))?;
    let numbers: Vec<u32> = (0..(BATCH * N_FRAMES) as u32).map(|i| i / 5 % 4).collect();
    let words = WordFrames {
        numbers: Tensor::from_vec(numbers, (BATCH, N_FRAMES), &Device::Cpu)?,
        times: tensor([BATCH, N_FRAMES, N_TIMES], 0.7)?,
        added: None,
    };
    Ok(WindowBatch {
        mels: tensor([BATCH, 64, N_MELS], phase)?,
        poses: (tensor([BATCH, N_FEATURES, N_FRAMES], phase + 5.0)? * &mask)?,
        mask,
        speakers: (0..BATCH).map(|i| (i * n_speakers / BATCH) as u32).collect(),
        words: has_words.then_some(words),
    })
}

/// Case: name, settings, number of speakers, size of the vocabulary.
type Case = (&'static str, GanSettings, usize, usize);

fn trainer((_, settings, n_speakers, vocabulary): &Case, from: Option<&Path>) -> Result<GanTrainer> {
    let mut trainer =
        GanTrainer::new(speakers(settings, *n_speakers, *vocabulary), settings.clone(), &orator::Device::Cpu)?;
    if let Some(from) = from {
        let contents = Contents::read(from)?;
        trainer.load(&TrainerState::from_checkpoint(&contents)?, &contents)?;
    }
    Ok(trainer)
}

/// Losses of `n` steps from a checkpoint, and the trainer after them.
fn steps(case: &Case, from: Option<&Path>, n: usize) -> Result<(Vec<Losses>, GanTrainer)> {
    let mut trainer = trainer(case, from)?;
    for _ in 0..n {
        let windows = windows(case.2, case.3 > 0, trainer.step)?;
        let network = trainer.speakers.network().clone();
        let batch = StepBatch::draw(&windows, &trainer.settings, &network, trainer.step, trainer.device())?;
        trainer.advance(&batch, &mut |_| ())?;
    }
    let losses = trainer.take_losses()?;
    let first = trainer.step - n;
    assert!(losses.iter().map(|(step, _)| *step).eq(first + 1..=first + n), "{losses:?}");
    Ok((losses.into_iter().map(|(_, losses)| losses).collect(), trainer))
}

/// Largest relative difference of a loss.
fn difference(a: &[Losses], b: &[Losses]) -> f64 {
    let numbers = |of: &Losses| {
        let weighted = [of.speed, of.energy].map(|loss| loss.unwrap_or(0.0));
        [&[of.l1, of.velocity, of.bone, of.adversarial, of.discriminator][..], &weighted].concat()
    };
    let off = |(a, b): (f64, f64)| (a - b).abs() / a.abs().max(1e-2);
    let all = a.iter().zip(b).flat_map(|(a, b)| numbers(a).into_iter().zip(numbers(b)).map(off).collect::<Vec<_>>());
    all.fold(0.0, |largest, off| if off.is_nan() { f64::INFINITY } else { largest.max(off) })
}

fn cases() -> Vec<Case> {
    let positions = orator_dataset::config::MotionRepresentation::Positions;
    vec![
        ("light", settings(|_| ()), 1, 0),
        ("noise", settings(|of| of.augment_pose_noise = 0.1), 1, 0),
        ("words", settings(|of| of.adversarial = AdversarialLoss::Log), 1, 4),
        ("speakers", settings(|of| (of.dropout, of.adversarial_from) = (0.0, 2)), 2, 0),
        (
            "rebol2021",
            settings(|of| {
                (of.preset, of.representation) = (NetworkPreset::Paper, positions);
                (of.adversarial, of.lambda_gan, of.lambda_velocity) = (AdversarialLoss::Minimax, 1.0, 0.5);
                (of.lambda_speed, of.lambda_energy, of.ema_decay, of.weight_decay) = (0.0, 0.0, 0.0, 0.0);
                (of.learning_rate, of.warmup_steps) = (1e-4, 0);
            }),
            1,
            0,
        ),
    ]
}

/// A difference in the last bit grows to some per cent of the losses in 20 steps at the learning rate of the recipe, on the
/// CPU alone as well: here the rate is 50 times lower.
#[test]
fn twenty_steps_from_one_checkpoint_agree() -> Result<()> {
    let Some(gpu) = GpuShim::with_threads(1) else { return Ok(()) };
    for mut case in cases() {
        (case.1.learning_rate, case.1.warmup_steps) = (2e-5, 0);
        let folder = tempfile::tempdir()?;
        steps(&case, None, 4)?.1.save(folder.path())?;
        let from = checkpoint::path(folder.path(), 4);
        let n = if case.0 == "rebol2021" { 4 } else { 20 };
        let (own, own_trainer) = steps(&case, Some(&from), n)?;
        let (of_gpu, gpu_trainer) = gpu.run(|| steps(&case, Some(&from), n))?;
        let off = difference(&own, &of_gpu);
        assert!(off < if case.0 == "light" { 1e-3 } else { 5e-3 }, "{}: {off:e}", case.0);
        // Validation uses the average and the running statistics.
        let windows = windows(case.2, case.3 > 0, 99)?;
        let (own_error, card_error) = (own_trainer.error(&windows)?, gpu.run(|| gpu_trainer.error(&windows))?);
        assert!((own_error / card_error - 1.0).abs() < 1e-3, "{}: {own_error} {card_error}", case.0);
    }
    Ok(())
}

#[test]
fn each_of_twenty_steps_at_the_rate_of_the_recipe_agrees() -> Result<()> {
    let Some(gpu) = GpuShim::with_threads(1) else { return Ok(()) };
    let (case, folder) = (&cases()[0], tempfile::tempdir()?);
    let mut own = trainer(case, None)?;
    for step in 0..20 {
        own.save(folder.path())?;
        let from = checkpoint::path(folder.path(), step);
        let losses = own.step(&windows(1, false, step)?)?;
        let (of_gpu, gpu_trainer) = gpu.run(|| steps(case, Some(&from), 1))?;
        let (off, norms) = (difference(&[losses], &of_gpu), [losses.gradient_norm, of_gpu[0].gradient_norm]);
        // A value at the kink of a leaky ReLU changes the norm, which bounds the gradients.
        let off_norm = (norms[0] / norms[1] - 1.0).abs();
        assert!(off < 1e-4 && off_norm < 1e-2, "step {step}: {off:e} {off_norm:e}");
        let others = gpu.run(|| gpu_trainer.generator_tensors())?;
        for (name, tensor) in own.generator_tensors()? {
            let off = (tensor - &others[&name])?.abs()?.max_all()?.to_scalar::<f32>()?;
            assert!(f64::from(off) < 0.1 * case.1.learning_rate, "step {step}, {name}: {off:e}");
        }
    }
    Ok(())
}

#[test]
fn a_checkpoint_of_either_device_continues_on_the_other() -> Result<()> {
    let Some(gpu) = GpuShim::with_threads(1) else { return Ok(()) };
    let case = &cases()[0];
    let folders = [tempfile::tempdir()?, tempfile::tempdir()?];
    let whole = steps(case, None, 6)?.0;
    steps(case, None, 3)?.1.save(folders[0].path())?;
    gpu.run(|| steps(case, None, 3)?.1.save(folders[1].path()))?;
    let paths = [0, 1].map(|i| checkpoint::path(folders[i].path(), 3));
    let [of_cpu, of_gpu] = [Contents::read(&paths[0])?, Contents::read(&paths[1])?];
    assert_eq!(of_cpu.facts, of_gpu.facts);
    assert!(
        of_cpu
            .tensors
            .iter()
            .map(|(name, of)| (name, of.dims()))
            .eq(of_gpu.tensors.iter().map(|(name, of)| (name, of.dims())))
    );
    let on_gpu = gpu.run(|| anyhow::Ok(steps(case, Some(&paths[0]), 3)?.0))?;
    let on_cpu = steps(case, Some(&paths[1]), 3)?.0;
    let again = gpu.run(|| anyhow::Ok(steps(case, Some(&paths[1]), 3)?.0))?;
    for losses in [on_gpu, on_cpu, again] {
        let off = difference(&whole[3..], &losses);
        assert!(off < 1e-2, "{off:e}");
    }
    Ok(())
}

/// Kernels and convolutions are counted; an operation of candle in a graph counts as 3 launches, one forward, and in the
/// backward pass one to allocate zeros and one to add the gradient, since those that remain are views and single sums.
#[test]
fn a_step_needs_few_launches_and_ten_steps_one_read() -> Result<()> {
    const LAUNCHES_PER_NODE: usize = 3;
    for (case, most) in cases().into_iter().zip([300, 300, 400, 400, 400]) {
        let Some(gpu) = GpuShim::with_threads(1) else { return Ok(()) };
        let (before, after) = gpu.run(|| {
            let (_, mut trainer) = steps(&case, None, 2)?;
            let counts = || [&gpu.n_launches, &gpu.n_nodes, &gpu.n_reads].map(std::cell::Cell::get);
            let before = counts();
            for _ in 0..10 {
                let windows = windows(case.2, case.3 > 0, trainer.step)?;
                let network = trainer.speakers.network().clone();
                let batch = StepBatch::draw(&windows, &trainer.settings, &network, trainer.step, trainer.device())?;
                trainer.advance(&batch, &mut |_| ())?;
            }
            assert_eq!(trainer.take_losses()?.len(), 10);
            anyhow::Ok((before, counts()))
        })?;
        let [launches, nodes, reads] = [0, 1, 2].map(|i| after[i] - before[i]);
        let per_step = (launches + LAUNCHES_PER_NODE * nodes) / 10;
        assert!(per_step <= most && reads == 1, "{}: {per_step} launches, {reads} reads", case.0);
    }
    Ok(())
}

#[test]
fn adam_agrees_with_that_of_the_cpu() -> Result<()> {
    let Some(gpu) = GpuShim::with_threads(1) else { return Ok(()) };
    for amsgrad in [false, true] {
        let descend = || -> Result<Vec<f32>> {
            let mut params = Params::new(3);
            let (w, b) = params.layer("w", &[50, 400], Init::Glorot, Init::Constant(0.5))?;
            params.trainable("frozen", &[3], Init::Constant(1.0))?;
            let config = adam::Config { amsgrad, max_norm: Some(2.0), weight_decay: 0.1, ..adam::Config::default() };
            let factors = |name: &str| if name == "frozen" { [0.0, 1.0] } else { [0.5, 2.0] };
            let mut adam = Adam::with_rates(&params, config, factors)?;
            let loss = |step: usize| w.sqr()?.sum_all()? * (step as f64 - 2.5) + b.sqr()?.sum_all()?;
            for step in 0..6 {
                if step == 4 {
                    let saved = adam.tensors("adam.")?;
                    adam = Adam::with_rates(&params, config, factors)?;
                    adam.load("adam.", &saved)?;
                }
                assert!(adam.step(&loss(step)?.backward()?, 0.1)? > 0.0);
            }
            let before = w.flatten_all()?.to_vec1::<f32>()?;
            assert!(adam.step(&(loss(0)? * f64::NAN)?.backward()?, 0.1)?.is_nan());
            let after = w.flatten_all()?.to_vec1::<f32>()?;
            assert_eq!(before, after, "an update by NaN");
            let tensors = params.tensors()?;
            Ok([after, tensors["w.bias"].to_vec1()?, tensors["frozen"].to_vec1()?].concat())
        };
        let (own, of_gpu) = (descend()?, gpu.run(descend)?);
        assert_eq!(own[own.len() - 3..], of_gpu[own.len() - 3..]);
        assert!(own.iter().zip(&of_gpu).all(|(a, b)| (a - b).abs() < 1e-5), "AMSGrad {amsgrad}");
    }
    Ok(())
}
