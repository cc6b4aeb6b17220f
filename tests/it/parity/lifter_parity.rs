//! The lifters agree with the same networks in PyTorch (`fixtures/reference/lifter_reference.py`): the temporal network
//! (in the reference in a dilated and a strided form) in f32 for inference, and in f64 for a training pass with
//! gradients. The networks are small and have weights computed from a formula.

use crate::fixtures::networks::{every_window, fill};
use candle_core::{DType, Device, Result, Tensor};
use orator_nn::Mode;
use orator_nn::lifter::hand;
use orator_nn::lifter::hand::HandLifter;
use orator_nn::lifter::temporal::{Config, TemporalLifter};
use orator_nn::params::Params;
use orator_test_support::gradcheck::pattern;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;

#[derive(serde::Deserialize)]
struct Golden {
    shape: Vec<usize>,
    values: Vec<f64>,
}

fn agree(name: &str, y: &Tensor) -> anyhow::Result<()> {
    let text = include_str!("../../../fixtures/reference/lifter_golden.json");
    let golden = serde_json::from_str::<BTreeMap<String, Golden>>(text)?.remove(name).unwrap();
    assert_eq!(y.dims(), golden.shape, "{name}");
    let y = y.to_dtype(DType::F64)?.flatten_all()?.to_vec1::<f64>()?;
    let scale = golden.values.iter().fold(1.0f64, |most, v| most.max(v.abs()));
    assert_eq!(y.len(), golden.values.len());
    for (i, (y, expected)) in y.iter().zip(&golden.values).enumerate() {
        assert!((y - expected).abs() < 1e-5 * scale, "{name}, value {i}: {y}, expected {expected}");
    }
    Ok(())
}

fn network(dtype: DType) -> anyhow::Result<(Params, TemporalLifter)> {
    let mut params = Params::with_dtype(0, dtype);
    let config = Config { n_in: 8, n_out: 9, channels: 12, widths: vec![3, 5, 3], dropout: 0.0 };
    let net = TemporalLifter::new(&mut params, "l", &config)?;
    fill(&params)?;
    Ok((params, net))
}

#[test]
fn the_temporal_lifter_agrees_with_both_forms_in_pytorch() -> anyhow::Result<()> {
    let (_params, net) = network(DType::F32)?;
    let input = |shape: &[usize], phase: f64| -> Result<Tensor> { pattern(shape, phase)?.to_dtype(DType::F32) };
    agree("dilated", &every_window(&net, &input(&[2, 8, 53], 3.0)?)?)?;
    agree("strided", &net.forward(&input(&[4, 8, 45], 4.0)?, &mut Mode::Eval)?)
}

#[test]
fn a_training_pass_agrees_with_pytorch() -> anyhow::Result<()> {
    let (params, net) = network(DType::F64)?;
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let y = net.forward(&pattern(&[4, 8, 45], 4.0)?, &mut Mode::Train(&mut rng))?;
    agree("train", &y)?;
    let errors = (y.reshape((4, 3, 3))? - pattern(&[4, 3, 3], 5.0)?)?;
    let weights = Tensor::new(&[[0.5, 1.0, 1.5]], &Device::Cpu)?;
    let loss = (errors.sqr()?.sum(2)? + 1e-8)?.sqrt()?.broadcast_mul(&weights)?.mean_all()?;
    agree("loss", &loss.reshape(1)?)?;
    let gradients = loss.backward()?;
    let var = |name: &str| params.all().find(|(own, _)| *own == name).map(|(_, var)| var.clone()).unwrap();
    for name in ["l.expand.conv.weight", "l.block1.over_time.norm.weight", "l.shrink.bias"] {
        agree(&format!("gradient {name}"), gradients.get(&var(name)).unwrap())?;
    }
    let running_var = "l.block0.mix.norm.running_var";
    agree(&format!("after {running_var}"), var(running_var).as_tensor())
}

#[test]
fn the_hand_perceptron_agrees_with_pytorch() -> anyhow::Result<()> {
    let mut params = Params::new(0);
    let config = hand::Config { n_in: 6, n_out: 5, hidden: 10, dropout: 0.0 };
    let net = HandLifter::new(&mut params, "h", &config)?;
    fill(&params)?;
    agree("hand", &net.forward(&pattern(&[7, 6], 6.0)?.to_dtype(DType::F32)?, &mut Mode::Eval)?)
}
