//! Generator and discriminator at their full sizes give what the same networks in PyTorch give
//! (`fixtures/reference/generator_reference.py`): outputs within 1e-4 and every gradient within 1e-3 in f32, as they are
//! trained, and both within 1e-6 in f64. Weights and inputs are filled by one formula on both sides.

use crate::fixtures::networks::{phase, value};
use candle_core::{DType, Result, Tensor, Var};
use orator_nn::cpu::axis::ConvAxis;
use orator_nn::gan::discriminator::Discriminator;
use orator_nn::gan::generator::{Config, Generator, Preset};
use orator_nn::ops::gradcheck::pattern;
use orator_nn::params::Params;
use std::collections::BTreeMap;

#[derive(serde::Deserialize)]
struct Golden {
    n_parameters: usize,
    shape: Vec<usize>,
    values: Vec<f64>,
    loss: f64,
    /// Norm, projections on two patterns, then some of the numbers.
    gradients: BTreeMap<String, Vec<f64>>,
    running: BTreeMap<String, Vec<f64>>,
}

fn golden(network: &str, train: bool) -> Golden {
    let text = include_str!("../../../fixtures/reference/generator_golden.json");
    let mut all: BTreeMap<String, BTreeMap<String, Golden>> = serde_json::from_str(text).unwrap();
    all.get_mut(network).and_then(|modes| modes.remove(if train { "train" } else { "eval" })).unwrap()
}

fn numbers(x: &Tensor) -> Result<Vec<f64>> {
    x.to_dtype(DType::F64)?.flatten_all()?.to_vec1()
}

/// Every tensor by the formula of the reference.
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

/// Every n-th number, as the reference takes them.
fn samples(x: &[f64], n: usize) -> impl Iterator<Item = f64> {
    x.iter().step_by((x.len() / n).max(1)).copied()
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Largest difference of norm, projections and samples, relative to the norm of the whole, `floor` at least. The
/// projections are scaled so that a difference of that relative size shows as itself; a sample counts against the
/// root mean square of all.
fn gradient_error(name: &str, gradient: &Tensor, golden: &[f64], floor: f64) -> Result<f64> {
    let g = numbers(gradient)?;
    let whole = golden[0].max(floor);
    let mut worst = (norm(&g) - golden[0]).abs() / whole;
    for (shift, expected) in [0.25, 0.75].into_iter().zip(&golden[1..]) {
        let p = numbers(&pattern(gradient.dims(), phase(name) + shift)?)?;
        let projection: f64 = g.iter().zip(&p).map(|(g, p)| g * p).sum();
        worst = worst.max((projection - expected).abs() * 3f64.sqrt() / whole);
    }
    assert_eq!(samples(&g, 8).count(), golden.len() - 3, "{name}");
    let each = samples(&g, 8).zip(&golden[3..]).map(|(v, e)| (v - e).abs() * (g.len() as f64).sqrt() / whole);
    Ok(each.fold(worst, f64::max))
}

/// Runs a network forward and backward and compares all of it; says the largest relative errors of the outputs, the
/// gradients and the running statistics.
fn compare(
    network: &str,
    train: bool,
    dtype: DType,
    params: &Params,
    x: &Tensor,
    wanted: Option<f64>,
    forward: impl Fn(&Tensor) -> Result<Tensor>,
) -> anyhow::Result<()> {
    let golden = golden(network, train);
    assert_eq!(params.n_parameters(), golden.n_parameters, "{network}");
    fill(params)?;
    let x = Var::from_tensor(&x.to_dtype(dtype)?)?;
    let y = forward(x.as_tensor())?;
    assert_eq!(y.dims(), golden.shape, "{network}");
    let wanted = match wanted {
        Some(value) => y.ones_like()?.affine(value, 0.0)?,
        None => pattern(y.dims(), 5.0)?.to_dtype(y.dtype())?,
    };
    let loss = (&y - wanted)?.sqr()?.mean_all()?;
    let gradients = loss.backward()?;

    let scale = norm(&golden.values);
    let off: Vec<f64> = samples(&numbers(&y)?, 60).zip(&golden.values).map(|(v, e)| v - e).collect();
    assert_eq!(off.len(), golden.values.len());
    let of_output = norm(&off) / scale;
    let worst_output = off.iter().fold(0.0f64, |most, v| most.max(v.abs())) * (off.len() as f64).sqrt() / scale;
    let of_loss = (numbers(&loss)?[0] - golden.loss).abs() / golden.loss;

    let mut of_gradients = Vec::new();
    for (name, var) in params.trainables().chain([("input", &x)]) {
        let Some(gradient) = gradients.get(var) else { anyhow::bail!("{network}: {name} has no gradient") };
        let expected = golden.gradients.get(name).unwrap();
        // Batch statistics take a constant of the convolution before them away: a true gradient of 0, and numbers of
        // the size of the rounding. Its scale is that of the constant behind.
        let behind = name.strip_suffix("conv.bias").map(|block| format!("{block}norm.bias"));
        let floor = match behind.filter(|_| train) {
            Some(behind) => golden.gradients[&behind][0],
            None => 0.0,
        };
        of_gradients.push((gradient_error(name, gradient, expected, floor)?, name));
    }
    assert_eq!(of_gradients.len(), golden.gradients.len(), "{network}");
    of_gradients.sort_by(|a, b| b.0.total_cmp(&a.0));

    let mut of_running = 0.0f64;
    for (name, var) in params.all().filter(|(name, _)| name.contains("running_")) {
        let expected = &golden.running[name];
        let off: Vec<f64> = samples(&numbers(var.as_tensor())?, 4).zip(expected).map(|(v, e)| v - e).collect();
        of_running = of_running.max(norm(&off) / norm(expected));
    }
    let mode = if train { "train" } else { "eval" };
    let (most_output, most_gradient) = if dtype == DType::F32 { (1e-4, 1e-3) } else { (1e-6, 1e-6) };
    eprintln!(
        "{network} {mode} {dtype:?}: output {of_output:.1e} (one number {worst_output:.1e}), loss {of_loss:.1e}, gradients {:.1e} \
         ({}), running statistics {of_running:.1e}",
        of_gradients[0].0, of_gradients[0].1
    );
    assert!(of_output.max(worst_output).max(of_loss) < most_output, "{network} {mode} {dtype:?}: output");
    assert!(of_gradients[0].0 < most_gradient, "{network} {mode} {dtype:?}: {:?}", &of_gradients[..3]);
    assert!(of_running < most_output, "{network} {mode} {dtype:?}: running statistics");
    Ok(())
}

fn generator(preset: Preset, network: &str, train: bool, dtype: DType) -> anyhow::Result<()> {
    let mut params = Params::with_dtype(0, dtype);
    let net = Generator::new(&mut params, &Config::from_preset(preset, 147))?;
    let mels = pattern(&[2, 64, 418], if preset == Preset::Paper { 15.0 } else { 25.0 })?;
    compare(network, train, dtype, &params, &mels, None, |mels| net.forward(mels, &[], 64, train))
}

#[test]
fn the_published_generator_trains_as_in_pytorch() -> anyhow::Result<()> {
    generator(Preset::Paper, "paper", true, DType::F32)
}

#[test]
fn the_published_generator_evaluates_as_in_pytorch() -> anyhow::Result<()> {
    generator(Preset::Paper, "paper", false, DType::F32)
}

#[test]
fn the_published_generator_is_that_of_pytorch_but_for_rounding() -> anyhow::Result<()> {
    generator(Preset::Paper, "paper", true, DType::F64)
}

#[test]
fn the_light_generator_trains_and_evaluates_as_in_pytorch() -> anyhow::Result<()> {
    generator(Preset::Light, "light", true, DType::F32)?;
    generator(Preset::Light, "light", false, DType::F32)
}

#[test]
fn the_light_generator_is_that_of_pytorch_but_for_rounding() -> anyhow::Result<()> {
    generator(Preset::Light, "light", true, DType::F64)
}

#[test]
fn the_discriminator_trains_and_evaluates_as_in_pytorch() -> anyhow::Result<()> {
    for (train, dtype) in [(true, DType::F32), (false, DType::F32), (true, DType::F64), (false, DType::F64)] {
        let mut params = Params::with_dtype(0, dtype);
        let net = Discriminator::new(&mut params, 144)?;
        let motion = pattern(&[2, 144, 63], 2.0)?;
        compare("discriminator", train, dtype, &params, &motion, Some(1.0), |x| net.forward(x, train))?;
    }
    Ok(())
}

#[test]
fn sizes_on_the_way_are_the_published_ones() -> anyhow::Result<()> {
    assert_eq!(orator_base::audio::mel::n_frames(67_267), 418);
    let halved = |n: usize| ConvAxis::same(n, 4, 2).n_out;
    assert_eq!([halved(418), halved(209), halved(105)], [209, 105, 53]);
    assert_eq!([halved(64), halved(32), halved(16)], [32, 16, 8]);
    // Kernels of three frames and eight bands, no padding: 53 x 8 becomes 51 x 1, in either preset's place.
    let mut params = Params::new(0);
    let net = Generator::new(&mut params, &Config { width: 8, ..Config::from_preset(Preset::Paper, 3) })?;
    let mels = pattern(&[2, 64, 418], 1.0)?.to_dtype(DType::F32)?;
    assert_eq!(net.encode(&mels, &[], false)?.dims(), [2, 51, 8]);
    Ok(())
}
