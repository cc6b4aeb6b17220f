//! Tests of `orator_nn::seq2seq::encoders`.

use candle_core::{Device, Result, Tensor};
use orator_nn::Mode;
use orator_nn::params::Params;
use orator_nn::seq2seq::config::{Config, Segment};
use orator_nn::seq2seq::encoders::{Decoder, WordEncoder, set_word_vectors};
use orator_test_support::gradcheck::pattern;

#[test]
fn word_vectors_are_set_for_the_named_encoder_only() -> Result<()> {
    let mut params = Params::new(1);
    let encoder = WordEncoder::new(&mut params, "spoken", [3, 2, 4])?;
    let states = |word: u32| encoder.last(&Tensor::new(&[[word]], &Device::Cpu)?)?.flatten_all()?.to_vec1::<f32>();
    let before = states(1)?;
    let vectors = Tensor::new(&[[0f64, 0.0], [1.0, 1.0], [0.5, -2.0]], &Device::Cpu)?;
    set_word_vectors(&params, "spoken", &vectors)?;
    let table = params.trainables().find(|(name, _)| *name == "spoken.embedding.weight").map(|(_, var)| var);
    assert_eq!(
        table.map(|var| var.to_vec2::<f32>()).transpose()?,
        Some(vec![vec![0.0; 2], vec![1.0; 2], vec![0.5, -2.0]])
    );
    assert!(states(1)? != before && states(1)? != states(2)?);
    for (name, shape) in [("other", (3, 2)), ("spoken", (2, 2)), ("spoken", (3, 3)), ("spoken", (2, 3))] {
        assert!(set_word_vectors(&params, name, &Tensor::zeros(shape, vectors.dtype(), &Device::Cpu)?).is_err());
    }
    assert!(encoder.last(&Tensor::new(&[[3u32]], &Device::Cpu)?).is_err());
    Ok(())
}

#[test]
fn a_carried_state_has_read_all_poses_since_the_initial_state() -> Result<()> {
    let config = Config { pose: 3, hidden: 4, previous: 5, predicted: 6, ..Config::default() };
    let decoder = Decoder::new(&mut Params::with_dtype(1, candle_core::DType::F64), "decoder", &config, &[8], 0.0)?;
    let encoded = [pattern(&[2, 6, 8], 0.0)?];
    let segment = |previous: Tensor| Segment { audio: encoded[0].clone(), previous, words: None };
    let first = segment(pattern(&[2, 5, 3], 1.0)?);
    let (poses, state) = decoder.continue_from(&first, &encoded, None)?;
    let max_difference = |a: &Tensor, b: &Tensor| (a - b)?.abs()?.max_all()?.to_scalar::<f64>();
    assert!(max_difference(&poses, &decoder.forward(&first, &encoded, None, &mut Mode::Eval)?)? < 1e-12);
    let (carried, _) = decoder.continue_from(&segment(poses.narrow(1, 1, 5)?), &encoded, Some(&state))?;
    // The first pose is read twice, as is the last pose before any segment.
    let read = Tensor::cat(&[&first.previous, &first.previous.narrow(1, 4, 1)?, &poses], 1)?;
    let all = decoder.decode(&read, &decoder.first_state(&encoded)?, &encoded, None, &mut Mode::Eval)?;
    assert!(max_difference(&carried, &all)? < 1e-12);
    let renewed = decoder.forward(&segment(poses.narrow(1, 1, 5)?), &encoded, None, &mut Mode::Eval)?;
    assert!(max_difference(&carried, &renewed)? > 1e-6);
    Ok(())
}
