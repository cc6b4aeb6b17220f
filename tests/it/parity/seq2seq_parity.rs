//! The sequence-to-sequence networks and their losses agree with PyTorch modules in outputs and all gradients
//! (`fixtures/reference/seq2seq_reference.py`). Both sides compute weights and inputs from the same formula.

use crate::fixtures::networks::{phase, value};
use candle_core::{DType, Device, Result, Tensor, Var};
use orator_dataset::config::AdversarialLoss;
use orator_gesture::train::gan::losses::generator_loss;
use orator_gesture::train::seq2seq::losses;
use orator_nn::Mode;
use orator_nn::params::Params;
use orator_nn::seq2seq::adversarial::SegmentDiscriminator;
use orator_nn::seq2seq::autoencoder::{PoseAutoencoder, SpeechEncoder};
use orator_nn::seq2seq::config::{Config, Segment};
use orator_nn::seq2seq::networks::{ContextSeq2Seq, WordsSeq2Seq};
use orator_nn::seq2seq::predict::{GesturePredictor, TruePoses};
use orator_test_support::gradcheck::pattern;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;

const BATCH: usize = 10;

#[derive(serde::Deserialize)]
struct Golden {
    #[serde(default)]
    eval: Vec<f64>,
    train: Vec<f64>,
    gradients: BTreeMap<String, Vec<f64>>,
    #[serde(default)]
    running: BTreeMap<String, Vec<f64>>,
}

fn golden(name: &str) -> Golden {
    let text = include_str!("../../../fixtures/reference/seq2seq_golden.json");
    let mut all: BTreeMap<String, Golden> = serde_json::from_str(text).unwrap();
    all.remove(name).unwrap()
}

/// Sizes of the reference, without dropout.
fn small() -> Config {
    Config {
        pose: 5,
        audio: 4,
        context: 7,
        previous: 3,
        predicted: 8,
        hidden: 6,
        vocabulary: 9,
        word: 5,
        word_hidden: 4,
        dropout_between: 0.0,
        dropout: 0.0,
        dropout_read: 0.0,
        score_channels: [6, 7],
        score_hidden: 5,
        pose_hidden: 8,
        code: 4,
        ..Config::default()
    }
}

fn inputs(words: Option<Tensor>, dtype: DType) -> Result<Segment> {
    let c = small();
    Ok(Segment {
        audio: pattern(&[BATCH, c.audio_frames(), c.audio], 1.0)?.to_dtype(dtype)?,
        previous: pattern(&[BATCH, c.previous, c.pose], 2.0)?.to_dtype(dtype)?,
        words,
    })
}

/// Word indices of the segments; most rows are padded with word 0.
fn words_of_segments() -> Result<Tensor> {
    let word = |b: usize, w: usize| if w < 1 + b % 4 { (7 * b + 3 * w) % 9 } else { 0 };
    let all = (0..BATCH).flat_map(|b| (0..4).map(move |w| word(b, w) as u32));
    Tensor::from_vec(all.collect::<Vec<u32>>(), (BATCH, 4), &Device::Cpu)
}

fn words_of_poses() -> Result<Tensor> {
    let n = small().predicted;
    let word = |b: usize, t: usize, w: usize| if w < 1 + (b + t) % 3 { (5 * b + 3 * t + w) % 9 } else { 0 };
    let of_row = move |b: usize| (0..n).flat_map(move |t| (0..3).map(move |w| word(b, t, w) as u32));
    Tensor::from_vec((0..BATCH).flat_map(of_row).collect::<Vec<u32>>(), (BATCH, n, 3), &Device::Cpu)
}

/// All tensors computed from the formula; weights of normalisation layers are around 1, as after training.
fn filled(params: &Params) -> Result<BTreeMap<String, Tensor>> {
    let is_norm_weight = |name: &str| name.contains("norm.") && name.ends_with(".weight");
    let tensors = params.all().map(|(name, var)| {
        let tensor = match is_norm_weight(name) {
            true => pattern(var.dims(), phase(name))?.affine(0.2, 1.0)?,
            false => value(name, var.dims())?,
        };
        Ok((name.to_owned(), tensor))
    });
    tensors.collect()
}

/// Largest error divided by the largest expected value, or by 1e-3 if that is larger.
fn relative_error(own: &Tensor, expected: &[f64]) -> Result<f64> {
    let own = own.to_dtype(DType::F64)?.flatten_all()?.to_vec1::<f64>()?;
    assert_eq!(own.len(), expected.len());
    let most = expected.iter().fold(1e-3f64, |most, v| most.max(v.abs()));
    Ok(own.iter().zip(expected).map(|(own, expected)| (own - expected).abs() / most).fold(0.0, f64::max))
}

/// Largest error of a gradient (f64) against central differences, relative to 1 + |gradient|, at three elements.
fn gradient_check_error(var: &Var, gradient: &Tensor, objective: impl Fn() -> Result<f64>) -> Result<f64> {
    const STEP: f64 = 1e-6;
    let (values, gradient) = (var.flatten_all()?.to_vec1::<f64>()?, gradient.flatten_all()?.to_vec1::<f64>()?);
    let mut worst = 0.0f64;
    for i in [0, values.len() / 2, values.len() - 1] {
        let at = |step: f64| -> Result<f64> {
            let mut moved = values.clone();
            moved[i] += step;
            var.set(&Tensor::from_vec(moved, var.shape(), &Device::Cpu)?)?;
            objective()
        };
        let difference = (at(STEP)? - at(-STEP)?) / (2.0 * STEP);
        at(0.0)?;
        worst = worst.max((gradient[i] - difference).abs() / (1.0 + difference.abs()));
    }
    Ok(worst)
}

/// Compares a network with the reference: outputs and running statistics to 1e-5 and gradients to 1e-3 in f32, all to
/// 1e-7 in f64, where gradients are also compared with central differences to 1e-5.
fn compare<N>(
    name: &str,
    build: impl Fn(&mut Params) -> Result<N>,
    run: impl Fn(&N, DType, &mut Mode) -> Result<Tensor>,
) -> anyhow::Result<()> {
    let golden = golden(name);
    for (dtype, max_output, max_gradient) in [(DType::F32, 1e-5, 1e-3), (DType::F64, 1e-7, 1e-7)] {
        let mut params = Params::with_dtype(0, dtype);
        let net = build(&mut params)?;
        params.load(&filled(&params)?)?;
        let evaluated = relative_error(&run(&net, dtype, &mut Mode::Eval)?, &golden.eval)?;
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let y = run(&net, dtype, &mut Mode::Train(&mut rng))?;
        let trained = relative_error(&y, &golden.train)?;
        assert!(evaluated.max(trained) < max_output, "{name} {dtype:?}: outputs {evaluated:e} {trained:e}");
        let gradients = (&y * pattern(y.dims(), 0.5)?.to_dtype(dtype)?)?.sum_all()?.backward()?;
        let names: Vec<&str> = params.trainables().map(|(own, _)| own).collect();
        assert_eq!(names, golden.gradients.keys().map(String::as_str).collect::<Vec<_>>(), "{name}");
        let mut worst = 0.0f64;
        for (own, var) in params.trainables() {
            let gradient = gradients.get(var).unwrap();
            assert_eq!(gradient.dims(), var.dims());
            let error = relative_error(gradient, &golden.gradients[own])?;
            assert!(error < max_gradient, "{name} {dtype:?}: gradient of {own} {error:e}");
            worst = worst.max(error);
        }
        for (own, var) in params.all().filter(|(own, _)| own.contains("running_")) {
            let error = relative_error(var.as_tensor(), &golden.running[own])?;
            assert!(error < max_output, "{name} {dtype:?}: {own} {error:e}");
        }
        if dtype == DType::F64 {
            let objective = || -> Result<f64> {
                let y = run(&net, dtype, &mut Mode::Train(&mut ChaCha8Rng::seed_from_u64(0)))?;
                (&y * pattern(y.dims(), 0.5)?)?.sum_all()?.to_scalar()
            };
            for (own, var) in params.trainables() {
                let error = gradient_check_error(var, gradients.get(var).unwrap(), objective)?;
                assert!(error < 1e-5, "{name}: gradient of {own} differs from central differences by {error:e}");
            }
        }
        eprintln!("{name} {dtype:?}: outputs {:.1e}, gradients {worst:.1e}", evaluated.max(trained));
    }
    Ok(())
}

#[test]
fn the_words_network_agrees_with_pytorch() -> anyhow::Result<()> {
    let run =
        |net: &WordsSeq2Seq, dtype, mode: &mut Mode| net.forward(&inputs(Some(words_of_segments()?), dtype)?, mode);
    compare("words", |params| WordsSeq2Seq::new(params, &small()), run)?;
    let config = Config { audio_context: true, ..small() };
    compare("words_context", |params| WordsSeq2Seq::new(params, &config), run)
}

#[test]
fn true_poses_as_inputs_of_some_decoder_steps_agree_with_pytorch() -> anyhow::Result<()> {
    let Config { predicted, pose, .. } = small();
    let is_taken = |b: usize, t: usize| (3 * b + 2 * t + b * t) % 5 < 2;
    let taken: Vec<bool> = (0..BATCH * predicted).map(|i| is_taken(i / predicted, i % predicted)).collect();
    let run = |net: &WordsSeq2Seq, dtype, mode: &mut Mode| {
        let poses = pattern(&[BATCH, predicted, pose], 3.0)?.to_dtype(dtype)?;
        let truth = TruePoses { poses: &poses, taken: &taken };
        net.forward_with_truth(&inputs(Some(words_of_segments()?), dtype)?, &truth, mode)
    };
    compare("words_truth", |params| WordsSeq2Seq::new(params, &small()), run)
}

#[test]
fn the_contextual_network_agrees_with_pytorch() -> anyhow::Result<()> {
    let run =
        |net: &ContextSeq2Seq, dtype, mode: &mut Mode| net.forward(&inputs(Some(words_of_poses()?), dtype)?, mode);
    compare("contextual", |params| ContextSeq2Seq::new(params, &small()), run)
}

#[test]
fn the_networks_without_words_agree_with_pytorch() -> anyhow::Result<()> {
    let run = |net: &WordsSeq2Seq, dtype, mode: &mut Mode| net.forward(&inputs(None, dtype)?, mode);
    compare("audio_only", |params| WordsSeq2Seq::audio_only(params, &small()), run)?;
    compare("adversarial", |params| WordsSeq2Seq::without_words(params, &small()), run)?;
    let more_blocks = Config { predicted: 16, score_blocks: 4, ..small() };
    for (name, config) in [("discriminator", small()), ("discriminator_blocks", more_blocks)] {
        let score = |net: &SegmentDiscriminator, dtype, mode: &mut Mode| {
            net.forward(&pattern(&[BATCH, config.predicted, config.pose], 3.0)?.to_dtype(dtype)?, mode.trains())
        };
        compare(name, |params| SegmentDiscriminator::new(params, &config), score)?;
    }
    Ok(())
}

#[test]
fn the_audio_baseline_agrees_with_pytorch() -> anyhow::Result<()> {
    let back = |net: &PoseAutoencoder, dtype, _: &mut Mode| {
        net.forward(&pattern(&[BATCH, 8, 5], 3.0)?.reshape((BATCH * 8, 5))?.to_dtype(dtype)?)
    };
    compare("autoencoder", |params| PoseAutoencoder::new(params, "", &small()), back)?;
    let code = |net: &SpeechEncoder, dtype, mode: &mut Mode| net.forward(&inputs(None, dtype)?.audio, mode);
    compare("speech", |params| SpeechEncoder::new(params, "", &small()), code)
}

#[test]
fn the_losses_agree_with_pytorch() -> anyhow::Result<()> {
    let real = &pattern(&[3, 6, 4], 5.0)?;
    type Loss<'a> = &'a dyn Fn(&Tensor) -> Result<Tensor>;
    let all: [(&str, Loss); 8] = [
        ("l1", &|predicted| losses::l1(predicted, real)),
        ("mse", &|predicted| candle_nn::loss::mse(predicted, real)),
        ("continuity_of_numbers", &losses::continuity_of_numbers),
        ("continuity_of_poses", &losses::continuity_of_poses),
        ("excursion", &losses::variance_loss_of_code),
        ("variance", &losses::variance_loss_of_paper),
        ("discriminator", &|predicted| losses::discriminator(predicted, real)),
        ("adversarial", &|predicted| generator_loss(AdversarialLoss::Log, predicted)),
    ];
    for (name, loss) in all {
        let golden = golden(&format!("loss {name}"));
        let predicted = Var::from_tensor(&pattern(&[3, 6, 4], 4.0)?)?;
        let value = loss(&predicted)?;
        assert!(relative_error(&value, &golden.train)? < 1e-7, "{name}");
        let gradients = value.backward()?;
        assert!(
            relative_error(gradients.get(&predicted).unwrap(), &golden.gradients["made"])? < 1e-7,
            "gradient of {name}"
        );
    }
    Ok(())
}
