//! The networks agree with their PyTorch counterparts (`fixtures/reference/networks_reference.py`); one formula fills
//! weights and inputs on both sides.

use crate::fixtures::networks::{every_window, fill};
use candle_core::{DType, Device, Tensor};
use orator_lab::train::space::auto_encoder::AutoEncoder;
use orator_nn::Mode;
use orator_nn::gan::discriminator::Discriminator;
use orator_nn::gan::generator;
use orator_nn::gan::generator::{Config, Generator, Preset};
use orator_nn::lifter::temporal;
use orator_nn::lifter::temporal::TemporalLifter;
use orator_nn::motion_encoder;
use orator_nn::params::Params;
use orator_test_support::gradcheck::pattern;
use std::collections::BTreeMap;

#[derive(serde::Deserialize)]
struct Golden {
    shape: Vec<usize>,
    values: Vec<f64>,
}

fn golden(name: &str) -> Golden {
    let text = include_str!("../../../fixtures/reference/networks_golden.json");
    let mut all: BTreeMap<String, Golden> = serde_json::from_str(text).unwrap();
    all.remove(name).unwrap()
}

fn assert_agrees(name: &str, y: &Tensor) -> anyhow::Result<()> {
    let golden = golden(name);
    assert_eq!(y.dims(), golden.shape, "{name}");
    let y = y.flatten_all()?.to_vec1::<f64>()?;
    let step = (y.len() / 60).max(1);
    for (i, (y, expected)) in y.iter().step_by(step).zip(&golden.values).enumerate() {
        assert!((y - expected).abs() < 1e-5, "{name}, value {i}: {y}, expected {expected}");
    }
    Ok(())
}

#[test]
fn generator_discriminator_and_lifter_agree_with_pytorch() -> anyhow::Result<()> {
    let mut params = Params::with_dtype(0, DType::F64);
    let config = Config { width: 16, ..Config::from_preset(Preset::Light, 6) };
    let net = Generator::new(&mut params, &config)?;
    fill(&params)?;
    assert_agrees("light", &net.forward(&pattern(&[2, 64, 427], 1.0)?, &[], 2 * generator::FRAMES_MULTIPLE, false)?)?;

    let mut params = Params::with_dtype(0, DType::F64);
    let net = Discriminator::new(&mut params, 12)?;
    fill(&params)?;
    assert_agrees("discriminator", &net.forward(&pattern(&[2, 12, 63], 2.0)?, false)?)?;

    let mut params = Params::with_dtype(0, DType::F64);
    let config = temporal::Config { n_in: 8, n_out: 9, channels: 12, widths: vec![3, 3, 3], dropout: 0.25 };
    let net = TemporalLifter::new(&mut params, "lifter", &config)?;
    fill(&params)?;
    assert_agrees("temporal_lifter", &every_window(&net, &pattern(&[2, 8, 31], 3.0)?)?)
}

#[test]
fn the_motion_encoder_agrees_with_pytorch_on_windows_and_sequences() -> anyhow::Result<()> {
    let config = motion_encoder::Config { n_in: 12, channels: [10, 8, 6], hidden: [16, 12] };
    let mut params = Params::with_dtype(0, DType::F64);
    let net = AutoEncoder::new(&mut params, &config)?;
    fill(&params)?;
    let mean: Vec<f32> = (0..12).map(|i| 0.01 * i as f32).collect();
    let std: Vec<f32> = (0..12).map(|i| 1.0 + 0.1 * i as f32).collect();
    net.encoder.set_statistics(&mean, &std)?;
    let x = net.encoder.normalised(&pattern(&[2, 12, 34], 4.0)?)?;
    assert_agrees("motion_code", &net.encoder.forward(&x, &Mode::Eval)?)?;
    assert_agrees("motion_back", &net.forward(&x, &Mode::Eval)?)?;

    let mut params = Params::with_dtype(0, DType::F32);
    let net = AutoEncoder::new(&mut params, &config)?;
    fill(&params)?;
    net.encoder.set_statistics(&mean, &std)?;
    let frames = ndarray::Array2::from_shape_fn((91, 12), |(t, i)| ((t * 12 + i) as f32 * 0.37).sin());
    let codes = net.encoder.codes(frames.view(), 4)?;
    assert_eq!(codes.dim(), (15, 32));
    for (n, code) in codes.outer_iter().enumerate() {
        let window = frames.slice(ndarray::s![4 * n..4 * n + 34, ..]);
        let window = Tensor::from_vec(window.t().iter().copied().collect(), (1, 12, 34), &Device::Cpu)?;
        let own =
            net.encoder.forward(&net.encoder.normalised(&window)?, &Mode::Eval)?.flatten_all()?.to_vec1::<f32>()?;
        assert!(code.iter().zip(&own).all(|(a, b)| (a - b).abs() < 1e-4), "window {n}");
    }
    Ok(())
}
