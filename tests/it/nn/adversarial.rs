//! Discriminators of sequence-to-sequence networks.

use candle_core::{DType, Result};
use orator_nn::params::Params;
use orator_nn::seq2seq::adversarial::SegmentDiscriminator;
use orator_nn::seq2seq::config::Config;
use orator_test_support::gradcheck::pattern;

#[test]
fn the_default_has_the_published_layout() -> Result<()> {
    let mut params = Params::new(1);
    SegmentDiscriminator::new(&mut params, &Config::default())?;
    let weights = params.trainables().filter(|(name, _)| name.ends_with(".weight"));
    let shapes: Vec<(&str, &[usize])> = weights.map(|(name, var)| (name, var.dims())).collect();
    let convolutions: [(&str, &[usize]); 2] = [("conv.0.weight", &[100, 45, 4]), ("conv.1.weight", &[200, 100, 3])];
    let linear: [(&str, &[usize]); 2] = [("linear.0.weight", &[100, 800]), ("linear.1.weight", &[1, 100])];
    let norms: [(&str, &[usize]); 2] = [("norm.0.weight", &[100]), ("norm.1.weight", &[200])];
    assert_eq!(shapes, [convolutions, linear, norms].concat());
    Ok(())
}

#[test]
fn two_to_six_blocks_are_possible_and_all_of_them_are_trained() -> Result<()> {
    for (predicted, n_frames) in [(15, 2), (20, 4)] {
        for n_blocks in 2..=6 {
            let config = Config { pose: 3, predicted, score_channels: [4, 5], score_hidden: 6, ..Config::default() };
            let config = Config { score_blocks: n_blocks, ..config };
            let mut params = Params::with_dtype(1, DType::F64);
            let net = SegmentDiscriminator::new(&mut params, &config)?;
            let logits = net.forward(&pattern(&[4, predicted, 3], 0.0)?, true)?;
            assert_eq!(logits.dims(), [4, 1]);
            assert_eq!(params.tensors()?["linear.0.weight"].dims(), [6, 5 * n_frames]);
            let gradients = logits.sqr()?.sum_all()?.backward()?;
            let is_weight = |name: &str| name.starts_with("conv.") && name.ends_with(".weight");
            let weights: Vec<_> = params.trainables().filter(|(name, _)| is_weight(name)).collect();
            assert_eq!(weights.len(), n_blocks);
            for (i, (name, var)) in weights.into_iter().enumerate() {
                let n_in = [3, 4, 5][i.min(2)];
                assert_eq!((name, var.dim(1)?), (format!("conv.{i}.weight").as_str(), n_in));
                let gradient = gradients.get(var).map(|gradient| gradient.abs()?.max_all()?.to_scalar::<f64>());
                assert!(gradient.transpose()?.is_some_and(|largest| largest > 1e-9), "{name} of {n_blocks} blocks");
            }
        }
    }
    Ok(())
}

#[test]
fn invalid_numbers_of_blocks_and_poses_are_errors() {
    for (predicted, score_blocks, part) in
        [(20, 0, "0 blocks"), (20, 1, "1 blocks"), (20, 7, "7 blocks"), (7, 2, ": 7")]
    {
        let config = Config { predicted, score_blocks, ..Config::default() };
        let error = SegmentDiscriminator::new(&mut Params::new(1), &config).err().map(|error| error.to_string());
        assert!(error.as_ref().is_some_and(|error| error.contains(part)), "{error:?}");
    }
}
