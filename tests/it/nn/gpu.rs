//! Networks with the kernels of a GPU, compiled for the CPU, equal those with the kernels for the CPU.

use crate::fixtures::gpu_shim::GpuShim;
use candle_core::{DType, Device, Result, Tensor, Var};
use orator_nn::gan::discriminator::{self, Discriminator};
use orator_nn::gan::generator::{Config, ConvBlock, Generator, Preset};
use orator_nn::gan::look_ahead::LookAhead;
use orator_nn::gan::words::{N_TIMES, WordFrames};
use orator_nn::gpu::gradients::{FlatGradients, backward};
use orator_nn::gpu::launch::{THREADS, result, run};
use orator_nn::ops::conv2d::Conv;
use orator_nn::ops::resize;
use orator_nn::params::Params;
use orator_test_support::gradcheck::pattern;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::sync::Arc;

type Network = Box<dyn Fn(&Tensor) -> Result<Tensor>>;
type Build = dyn Fn(&mut Params) -> Result<Network>;

/// Result, gradients of input and parameters, and the values of all tensors after the pass, by name.
fn passed(build: &Build, x: &Tensor, gpu: Option<&Rc<GpuShim>>) -> anyhow::Result<BTreeMap<String, Vec<f64>>> {
    let mut params = Params::with_dtype(3, x.dtype());
    let network = build(&mut params)?;
    for (i, (name, var)) in params.all().enumerate().filter(|(_, (_, var))| var.rank() == 1) {
        let around = if name.ends_with("norm.weight") || name.ends_with("var") { 1.5 } else { 0.0 };
        var.set(&(pattern(var.dims(), 5.0 + i as f64)? * 0.7)?.affine(1.0, around)?.to_dtype(x.dtype())?)?;
    }
    let x = Var::from_tensor(x)?;
    let vars = params.trainables().map(|(name, var)| (name.to_owned(), var.clone()));
    let vars: Vec<(String, Var)> = vars.chain([("input".to_owned(), x.clone())]).collect();
    let y = network(x.as_tensor())?;
    let loss = (&y * pattern(y.dims(), 0.5)?.to_dtype(x.dtype())?)?.sum_all()?;
    let values = |tensor: &Tensor| tensor.contiguous()?.flatten_all()?.to_dtype(DType::F64)?.to_vec1();
    let mut all: BTreeMap<String, Vec<f64>> = BTreeMap::from([("result".to_owned(), values(&y)?)]);
    let of_gpu = Arc::new(FlatGradients::of(vars.iter().map(|(_, var)| var.clone()).collect())?);
    let of_cpu = match gpu {
        Some(_) => backward(&loss, &of_gpu).map(|()| None)?,
        None => Some(loss.backward()?),
    };
    for (name, var) in &vars {
        let gradient = of_cpu.as_ref().map_or(of_gpu.get(var), |of_cpu| of_cpu.get(var));
        all.insert(format!("gradient of {name}"), gradient.map_or(Ok(vec![0.0; var.elem_count()]), values)?);
    }
    for (name, var) in params.all() {
        all.insert(format!("value of {name}"), values(var)?);
    }
    Ok(all)
}

/// Largest difference between a GPU and the CPU, relative to the largest value of each tensor.
fn difference(build: &Build, x: &Tensor, gpu: &Rc<GpuShim>) -> anyhow::Result<f64> {
    let own = passed(build, x, None)?;
    let n_before = gpu.n_launches.get();
    let of_gpu = gpu.run(|| passed(build, x, Some(gpu)))?;
    assert!(gpu.n_launches.get() > n_before + 2, "the kernels of a GPU were not used");
    assert_eq!(own.keys().collect::<Vec<_>>(), of_gpu.keys().collect::<Vec<_>>());
    let mut largest = 0.0f64;
    for (name, own) in &own {
        let scale = own.iter().fold(1e-3f64, |scale, v| scale.max(v.abs()));
        let off = own.iter().zip(&of_gpu[name]).fold(0.0f64, |off, (a, b)| {
            let off_here = (a - b).abs() / scale;
            if off_here.is_nan() { f64::INFINITY } else { off.max(off_here) }
        });
        assert!(off < 1e-2, "{name}: {off:e}");
        largest = largest.max(off);
    }
    Ok(largest)
}

/// Largest relative differences in f64 and in f32.
const TOLERANCES: [(DType, f64); 2] = [(DType::F64, 1e-10), (DType::F32, 1e-5)];

/// Inputs, kernels and strides as in the networks, but small: over time, over time and frequency; even, odd and short.
const LAYERS: [(&[usize], &[usize], usize); 13] = [
    (&[2, 9, 3], &[5, 3, 3], 1),
    (&[2, 12, 2], &[3, 2, 4], 2),
    (&[3, 13, 2], &[3, 2, 4], 2),
    (&[2, 2, 3], &[2, 3, 4], 2),
    (&[2, 1, 3], &[2, 3, 3], 1),
    (&[3, 16, 2], &[3, 2, 4], 1),
    (&[2, 7, 2], &[3, 2, 1], 1),
    (&[2, 40, 2], &[3, 2, 31], 1),
    (&[2, 6, 5, 2], &[3, 2, 3, 3], 1),
    (&[2, 9, 8, 2], &[3, 2, 4, 4], 2),
    (&[2, 7, 7, 1], &[3, 1, 4, 4], 2),
    (&[2, 8, 9, 3], &[4, 3, 4, 4], 2),
    (&[2, 6, 7, 3], &[4, 3, 4, 4], 1),
];

#[test]
fn layers_equal_those_of_the_cpu() -> anyhow::Result<()> {
    let Some(gpu) = GpuShim::with_threads(1) else { return Ok(()) };
    for ((shape, weight, stride), (dtype, tolerance)) in
        LAYERS.into_iter().flat_map(|layer| TOLERANCES.map(|tolerance| (layer, tolerance)))
    {
        let x = pattern(shape, 0.0)?.to_dtype(dtype)?;
        for train in [true, false] {
            let build = move |params: &mut Params| -> Result<Network> {
                let block = ConvBlock::new(params, "block", weight, stride, 0.1)?;
                Ok(Box::new(move |x| block.forward(x, train)))
            };
            let off = difference(&build, &x, &gpu)?;
            assert!(off < tolerance, "{shape:?} {weight:?} {stride} {train} {dtype:?}: {off:e}");
        }
        let build = move |params: &mut Params| -> Result<Network> {
            let conv = Conv::new(params, "conv", weight, stride)?;
            Ok(Box::new(move |x| conv.forward(x)))
        };
        let off = difference(&build, &x, &gpu)?;
        assert!(off < tolerance, "{shape:?} {weight:?} {stride} without norm {dtype:?}: {off:e}");
    }
    for (dtype, tolerance) in TOLERANCES {
        let build = |params: &mut Params| -> Result<Network> {
            let block = ConvBlock::full_height(params, "block", [3, 2, 3, 4], 0.01)?;
            Ok(Box::new(move |x| block.forward(x, true)))
        };
        let off = difference(&build, &pattern(&[2, 7, 4, 2], 0.0)?.to_dtype(dtype)?, &gpu)?;
        assert!(off < tolerance, "full height {dtype:?}: {off:e}");
        for (n_in, n_out) in [(3, 5), (7, 6), (54, 64), (64, 9), (1, 6), (8, 1), (213, 32)] {
            let build = move |_: &mut Params| -> Result<Network> { Ok(Box::new(move |x| resize::linear(x, n_out))) };
            let off = difference(&build, &pattern(&[2, n_in, 3], 0.0)?.to_dtype(dtype)?, &gpu)?;
            assert!(off < tolerance, "{n_in} to {n_out} frames, {dtype:?}: {off:e}");
        }
    }
    Ok(())
}

/// Words at the frames of two sounds.
fn words(n_frames: usize, dtype: DType) -> Result<WordFrames> {
    let numbers: Vec<u32> = (0..2 * n_frames as u32).map(|i| i / 5 % 4).collect();
    let times = pattern(&[2, n_frames, N_TIMES], 0.7)?.to_dtype(dtype)?;
    Ok(WordFrames { numbers: Tensor::from_vec(numbers, (2, n_frames), &Device::Cpu)?, times, added: None })
}

#[test]
fn networks_equal_those_of_the_cpu() -> anyhow::Result<()> {
    let Some(gpu) = GpuShim::with_threads(1) else { return Ok(()) };
    let bounded = LookAhead { secs: 0.5, shift: 10, encoded_per_frame: (20, 24) };
    for (preset, vocabulary, n_speakers, n_frames, look_ahead) in [
        (Preset::Light, 0, 0, 64, None),
        (Preset::Light, 4, 2, 40, None),
        (Preset::Paper, 0, 0, 32, None),
        (Preset::Light, 0, 0, 64, Some(bounded)),
    ] {
        for (dtype, tolerance) in TOLERANCES {
            let build = move |params: &mut Params| -> Result<Network> {
                let plain = Config { n_mels: 8, width: 8, look_ahead, ..Config::from_preset(preset, 6) };
                let config = Config { vocabulary, word: 3, n_speakers, speaker_weights: n_speakers > 0, ..plain };
                let network = Generator::new(params, &config)?;
                Ok(Box::new(move |mels| {
                    let words = if vocabulary > 0 { Some(words(n_frames, dtype)?) } else { None };
                    let frames = network.frames(mels, &[1, 0], words.as_ref(), n_frames, true)?;
                    network.decode(&(&frames * 0.7)?, true)
                }))
            };
            let x = pattern(&[2, 8, n_frames * 20 / 3], 1.0)?.to_dtype(dtype)?;
            let off = difference(&build, &x, &gpu)?;
            // Rounding grows from layer to layer; there are 25.
            let tolerance = if dtype == DType::F32 { 10.0 * tolerance } else { tolerance };
            assert!(off < tolerance, "{preset:?} {vocabulary} {n_speakers} {dtype:?}: {off:e}");
        }
    }
    for n_frames in [31, 64] {
        let build = |params: &mut Params| -> Result<Network> {
            let network = Discriminator::new(params, 6)?;
            Ok(Box::new(move |poses| network.forward(&discriminator::motion(poses)?, true)))
        };
        let off = difference(&build, &pattern(&[2, 6, n_frames], 1.0)?, &gpu)?;
        assert!(off < 1e-10, "{n_frames} frames: {off:e}");
    }
    Ok(())
}

#[test]
fn groups_of_a_batch_are_scored_one_after_the_other() -> anyhow::Result<()> {
    let Some(gpu) = GpuShim::with_threads(1) else { return Ok(()) };
    let motion = pattern(&[4, 6, 31], 0.0)?;
    let run = |n_groups: usize| -> anyhow::Result<(Vec<f64>, BTreeMap<String, Tensor>)> {
        let mut params = Params::with_dtype(1, DType::F64);
        let network = Discriminator::new(&mut params, 6)?;
        let parts = motion.chunk(if n_groups == 1 { 2 } else { 1 }, 0)?;
        let scores = parts.iter().map(|part| network.scores_of_groups(part, true, n_groups));
        let scores = Tensor::cat(&scores.collect::<Result<Vec<_>>>()?, 0)?;
        Ok((scores.flatten_all()?.to_vec1()?, params.tensors()?))
    };
    let ((apart, tensors), (together, others)) = gpu.run(|| anyhow::Ok((run(1)?, run(2)?)))?;
    assert!(apart.iter().zip(&together).all(|(a, b)| (a - b).abs() < 1e-12));
    for (name, tensor) in tensors {
        let off = (tensor - &others[&name])?.abs()?.max_all()?.to_scalar::<f64>()?;
        assert!(off < 1e-12, "{name}: {off:e}");
    }
    Ok(())
}

#[test]
fn any_number_of_threads_gives_the_same_result() -> anyhow::Result<()> {
    let (Some(one), Some(many)) = (GpuShim::with_threads(1), GpuShim::with_threads(8)) else { return Ok(()) };
    let build = |params: &mut Params| -> Result<Network> {
        let block = ConvBlock::new(params, "block", &[3, 2, 4], 2, 0.1)?;
        Ok(Box::new(move |x| resize::linear(&block.forward(x, true)?, 9)))
    };
    let x = pattern(&[3, 13, 2], 0.0)?;
    let [one, many] = [one, many].map(|gpu| gpu.run(|| passed(&build, &x, Some(&gpu))));
    for ((name, a), b) in one?.into_iter().zip(many?.into_values()) {
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-12), "{name}: {a:?} {b:?}");
    }
    Ok(())
}

#[test]
fn tensors_that_a_kernel_cannot_read_are_errors() -> anyhow::Result<()> {
    let Some(gpu) = GpuShim::with_threads(1) else { return Ok(()) };
    let x = pattern(&[2, 3, 4], 0.0)?;
    let message = gpu.run(|| run("accumulate", &[Some(&x.t()?), Some(&x)], &[24], &[], 1)).unwrap_err().to_string();
    assert!(message.contains("contiguous"), "{message}");
    let message = run("accumulate", &[Some(&x), Some(&result(24, &x)?)], &[24], &[], 1).unwrap_err().to_string();
    assert!(message.contains("feature `cuda`") || cfg!(feature = "cuda"), "{message}");
    assert!(THREADS.is_power_of_two());
    Ok(())
}
