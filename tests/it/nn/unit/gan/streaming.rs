//! Tests of `orator_nn::gan::streaming`.

use candle_core::{DType, Result, Tensor};
use orator_nn::gan::generator::{Config, Generator, Preset};
use orator_nn::gan::streaming::{StreamingGenerator, n_encoded_frames};
use orator_nn::params::Params;
use orator_test_support::gradcheck::pattern;
use std::collections::BTreeMap;
use std::ops::Range;

#[test]
fn encoded_frames_are_counted_correctly() {
    assert_eq!([418, 425, 8, 1].map(|n| n_encoded_frames(Preset::Light, n)), [53, 54, 1, 1]);
    assert_eq!([418, 425, 17, 16].map(|n| n_encoded_frames(Preset::Paper, n)), [51, 52, 1, 0]);
}

/// Network with random parameters and running statistics in f64, so that errors at the ends of pieces are
/// detectable.
fn network(preset: Preset) -> anyhow::Result<Generator> {
    let mut params = Params::with_dtype(5, DType::F64);
    let net = Generator::new(&mut params, &Config { n_mels: 8, width: 8, ..Config::from_preset(preset, 3) })?;
    let mut tensors: BTreeMap<_, _> = params.tensors()?;
    for (i, (name, tensor)) in tensors.iter_mut().enumerate().filter(|(_, (_, t))| t.rank() == 1) {
        let around = if name.ends_with("running_var") || name.ends_with("norm.weight") { 1.0 } else { 0.0 };
        *tensor = (pattern(tensor.dims(), 17.0 * i as f64)? * 0.5)?.affine(1.0, around)?;
    }
    params.load(&tensors)?;
    Ok(net)
}

#[test]
fn chunks_of_any_size_equal_one_pass() -> anyhow::Result<()> {
    for preset in [Preset::Light, Preset::Paper] {
        let net = network(preset)?;
        // 6.67 spectrogram frames per pose frame, and other ratios, even and odd.
        for (n_mel, n_frames) in [(213, 32), (427, 64), (2994, 448), (6829, 1024), (2003, 608)] {
            let mels = pattern(&[1, 8, n_mel], 3.0)?;
            let one_pass = net.forward(&mels, &[], n_frames, false)?;
            for chunk in [32, 96, 256, 4096] {
                let mels = |frames: Range<usize>| mels.narrow(2, frames.start, frames.len());
                let chunks = StreamingGenerator::new(&net, preset, n_mel, n_frames, chunk, mels)?;
                let parts = chunks.collect::<Result<Vec<_>>>()?;
                assert!(parts.iter().all(|part| part.dims()[2] <= chunk));
                let off = (Tensor::cat(&parts, 2)? - &one_pass)?.abs()?.max_all()?.to_scalar::<f64>()?;
                assert!(off < 1e-11, "{preset:?}, {n_mel} to {n_frames} by {chunk}: {off:e}");
            }
        }
        let mels = |_: Range<usize>| candle_core::bail!("no sound");
        assert!(StreamingGenerator::new(&net, preset, 427, 64, 33, mels).is_err());
        assert!(StreamingGenerator::new(&net, preset, 0, 64, 32, mels).is_err());
        assert_eq!(StreamingGenerator::new(&net, preset, 427, 64, 32, mels)?.filter(|made| made.is_err()).count(), 1);
    }
    Ok(())
}
