//! The full-size generator and discriminator agree with the same networks in PyTorch
//! (`fixtures/reference/generator_reference.py`): outputs within 1e-4 and gradients within 1e-3 in f32, the training
//! precision, and both within 1e-6 in f64. Both sides compute weights and inputs from the same formula.

use crate::fixtures::networks::{phase, value};
use candle_core::{DType, Result, Tensor, Var};
use orator_nn::cpu::axis::ConvAxis;
use orator_nn::gan::discriminator::Discriminator;
use orator_nn::gan::generator::{Config, Generator, Preset};
use orator_nn::params::Params;
use orator_test_support::gradcheck::pattern;
use std::collections::BTreeMap;

#[derive(serde::Deserialize)]
struct Golden {
    n_parameters: usize,
    shape: Vec<usize>,
    values: Vec<f64>,
    loss: f64,
    /// Norm, projections onto two patterns, then samples of the values.
    gradients: BTreeMap<String, Vec<f64>>,
    running: BTreeMap<String, Vec<f64>>,
}

fn golden(network: &str, train: bool) -> Golden {
    let text = include_str!("../../../fixtures/reference/generator_golden.json");
    let mut all: BTreeMap<String, BTreeMap<String, Golden>> = serde_json::from_str(text).unwrap();
    all.get_mut(network).and_then(|modes| modes.remove(if train { "train" } else { "eval" })).unwrap()
}

fn values_f64(x: &Tensor) -> Result<Vec<f64>> {
    x.to_dtype(DType::F64)?.flatten_all()?.to_vec1()
}

/// Sets every tensor by the formula of the reference.
fn fill(params: &Params) -> anyhow::Result<()> {
    let filled = params.all().map(|(name, var)| {
        let p = || pattern(var.dims(), phase(name));
        let tensor = match name {
            _ if name.ends_with("norm.bias") => ((p()?.sign()? * 3.0)? + (p()? * 0.5)?)?,
            _ if name.ends_with("running_var") => p()?.affine(0.25, 0.5)?,
            _ => value(name, var.dims())?,
        };
        Ok((name.to_owned(), tensor))
    });
    params.load(&filled.collect::<Result<_>>()?)
}

/// About `n` equally spaced values, as the reference samples them.
fn samples(x: &[f64], n: usize) -> impl Iterator<Item = f64> {
    x.iter().step_by((x.len() / n).max(1)).copied()
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Largest error of norm, projections and samples, relative to the norm of the golden gradient, `floor` at least.
/// Projections are divided by the root mean square of the pattern, 1/sqrt(3); samples are relative to the root mean
/// square of the gradient.
fn gradient_error(name: &str, gradient: &Tensor, golden: &[f64], floor: f64) -> Result<f64> {
    let g = values_f64(gradient)?;
    let scale = golden[0].max(floor);
    let mut worst = (norm(&g) - golden[0]).abs() / scale;
    for (shift, expected) in [0.25, 0.75].into_iter().zip(&golden[1..]) {
        let p = values_f64(&pattern(gradient.dims(), phase(name) + shift)?)?;
        let projection: f64 = g.iter().zip(&p).map(|(g, p)| g * p).sum();
        worst = worst.max((projection - expected).abs() * 3f64.sqrt() / scale);
    }
    assert_eq!(samples(&g, 8).count(), golden.len() - 3, "{name}");
    let each = samples(&g, 8).zip(&golden[3..]).map(|(v, e)| (v - e).abs() * (g.len() as f64).sqrt() / scale);
    Ok(each.fold(worst, f64::max))
}

/// Runs a network forward and backward, checks and prints the largest relative errors of the outputs, the gradients and
/// the running statistics.
fn compare(
    network: &str,
    train: bool,
    dtype: DType,
    params: &Params,
    x: &Tensor,
    target: Option<f64>,
    forward: impl Fn(&Tensor) -> Result<Tensor>,
) -> anyhow::Result<()> {
    let golden = golden(network, train);
    assert_eq!(params.n_parameters(), golden.n_parameters, "{network}");
    fill(params)?;
    let x = Var::from_tensor(&x.to_dtype(dtype)?)?;
    let y = forward(x.as_tensor())?;
    assert_eq!(y.dims(), golden.shape, "{network}");
    let target = match target {
        Some(value) => y.ones_like()?.affine(value, 0.0)?,
        None => pattern(y.dims(), 5.0)?.to_dtype(y.dtype())?,
    };
    let loss = (&y - target)?.sqr()?.mean_all()?;
    let gradients = loss.backward()?;

    let scale = norm(&golden.values);
    let errors: Vec<f64> = samples(&values_f64(&y)?, 60).zip(&golden.values).map(|(v, e)| v - e).collect();
    assert_eq!(errors.len(), golden.values.len());
    let output_error = norm(&errors) / scale;
    let worst_sample = errors.iter().fold(0.0f64, |most, v| most.max(v.abs())) * (errors.len() as f64).sqrt() / scale;
    let loss_error = (values_f64(&loss)?[0] - golden.loss).abs() / golden.loss;

    let mut gradient_errors = Vec::new();
    for (name, var) in params.trainables().chain([("input", &x)]) {
        let Some(gradient) = gradients.get(var) else { anyhow::bail!("{network}: {name} has no gradient") };
        let expected = golden.gradients.get(name).unwrap();
        // Batch normalisation cancels the bias of the convolution before it: the true gradient is 0, the computed one
        // is rounding error. Its scale is the gradient of the bias of the normalisation.
        let norm_bias = name.strip_suffix("conv.bias").map(|block| format!("{block}norm.bias"));
        let floor = match norm_bias.filter(|_| train) {
            Some(norm_bias) => golden.gradients[&norm_bias][0],
            None => 0.0,
        };
        gradient_errors.push((gradient_error(name, gradient, expected, floor)?, name));
    }
    assert_eq!(gradient_errors.len(), golden.gradients.len(), "{network}");
    gradient_errors.sort_by(|a, b| b.0.total_cmp(&a.0));

    let mut running_error = 0.0f64;
    for (name, var) in params.all().filter(|(name, _)| name.contains("running_")) {
        let expected = &golden.running[name];
        let errors: Vec<f64> = samples(&values_f64(var.as_tensor())?, 4).zip(expected).map(|(v, e)| v - e).collect();
        running_error = running_error.max(norm(&errors) / norm(expected));
    }
    let mode = if train { "train" } else { "eval" };
    let (max_output, max_gradient) = if dtype == DType::F32 { (1e-4, 1e-3) } else { (1e-6, 1e-6) };
    eprintln!(
        "{network} {mode} {dtype:?}: output {output_error:.1e} (one value {worst_sample:.1e}), loss {loss_error:.1e}, \
         gradients {:.1e} ({}), running statistics {running_error:.1e}",
        gradient_errors[0].0, gradient_errors[0].1
    );
    assert!(output_error.max(worst_sample).max(loss_error) < max_output, "{network} {mode} {dtype:?}: output");
    assert!(gradient_errors[0].0 < max_gradient, "{network} {mode} {dtype:?}: {:?}", &gradient_errors[..3]);
    assert!(running_error < max_output, "{network} {mode} {dtype:?}: running statistics");
    Ok(())
}

fn generator(preset: Preset, network: &str, train: bool, dtype: DType) -> anyhow::Result<()> {
    let mut params = Params::with_dtype(0, dtype);
    let net = Generator::new(&mut params, &Config::from_preset(preset, 147))?;
    let mels = pattern(&[2, 64, 418], if preset == Preset::Paper { 15.0 } else { 25.0 })?;
    compare(network, train, dtype, &params, &mels, None, |mels| net.forward(mels, &[], 64, train))
}

#[test]
fn the_published_generator_agrees_with_pytorch_in_training() -> anyhow::Result<()> {
    generator(Preset::Paper, "paper", true, DType::F32)
}

#[test]
fn the_published_generator_agrees_with_pytorch_in_evaluation() -> anyhow::Result<()> {
    generator(Preset::Paper, "paper", false, DType::F32)
}

#[test]
fn the_published_generator_agrees_with_pytorch_in_f64() -> anyhow::Result<()> {
    generator(Preset::Paper, "paper", true, DType::F64)
}

#[test]
fn the_light_generator_agrees_with_pytorch() -> anyhow::Result<()> {
    generator(Preset::Light, "light", true, DType::F32)?;
    generator(Preset::Light, "light", false, DType::F32)
}

#[test]
fn the_light_generator_agrees_with_pytorch_in_f64() -> anyhow::Result<()> {
    generator(Preset::Light, "light", true, DType::F64)
}

#[test]
fn the_discriminator_agrees_with_pytorch() -> anyhow::Result<()> {
    for (train, dtype) in [(true, DType::F32), (false, DType::F32), (true, DType::F64), (false, DType::F64)] {
        let mut params = Params::with_dtype(0, dtype);
        let net = Discriminator::new(&mut params, 144)?;
        let motion = pattern(&[2, 144, 63], 2.0)?;
        compare("discriminator", train, dtype, &params, &motion, Some(1.0), |x| net.forward(x, train))?;
    }
    Ok(())
}

#[test]
fn intermediate_sizes_are_the_published_ones() -> anyhow::Result<()> {
    assert_eq!(orator_base::audio::mel::n_frames(67_267), 418);
    let halved = |n: usize| ConvAxis::same(n, 4, 2).n_out;
    assert_eq!([halved(418), halved(209), halved(105)], [209, 105, 53]);
    assert_eq!([halved(64), halved(32), halved(16)], [32, 16, 8]);
    // An unpadded kernel of three frames and eight bands reduces 53 x 8 to 51 x 1.
    let mut params = Params::new(0);
    let net = Generator::new(&mut params, &Config { width: 8, ..Config::from_preset(Preset::Paper, 3) })?;
    let mels = pattern(&[2, 64, 418], 1.0)?.to_dtype(DType::F32)?;
    assert_eq!(net.encode(&mels, &[], false)?.dims(), [2, 51, 8]);
    Ok(())
}
