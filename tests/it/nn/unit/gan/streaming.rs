//! Tests of `orator_nn::gan::streaming`.

use candle_core::{DType, Result, Tensor};
use orator_nn::gan::generator::{Config, Generator, Preset};
use orator_nn::gan::look_ahead::LookAhead;
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
fn network(preset: Preset, look_ahead: Option<LookAhead>) -> anyhow::Result<Generator> {
    let mut params = Params::with_dtype(5, DType::F64);
    let config = Config { n_mels: 8, width: 8, look_ahead, ..Config::from_preset(preset, 3) };
    let net = Generator::new(&mut params, &config)?;
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
        let net = network(preset, None)?;
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

/// View of the future of a network with 20 / 3 spectrogram frames per pose frame.
fn bounded(preset: Preset, secs: f64) -> LookAhead {
    LookAhead::new(preset, secs, (20, 3), 100.0, 2.5)
}

#[test]
fn the_sound_is_moved_by_the_look_ahead_less_the_reach_of_the_encoder() {
    let shifts = |preset| [0.25, 0.5, 2.0].map(|secs| bounded(preset, secs).shift);
    assert_eq!(shifts(Preset::Light), [-15, 10, 160]);
    assert_eq!(shifts(Preset::Paper), [-31, -6, 144]);
}

#[test]
fn chunks_of_any_size_equal_one_pass_without_the_future() -> anyhow::Result<()> {
    for preset in [Preset::Light, Preset::Paper] {
        let net = network(preset, Some(bounded(preset, 0.5)))?;
        let (n_mel, n_frames) = (2987, 448);
        let mels = pattern(&[1, 8, n_mel], 3.0)?;
        let one_pass = net.forward(&mels, &[], n_frames, false)?;
        for chunk in [1, 7, 32, 300] {
            let mut read = 0;
            let of_chunks = |frames: Range<usize>| {
                read = frames.end;
                mels.narrow(2, frames.start, frames.len())
            };
            // As for a sound without end.
            let chunks = StreamingGenerator::new(&net, preset, n_mel, 1 << 20, chunk, of_chunks)?;
            let n = 416 / chunk * chunk;
            let parts = chunks.take(n / chunk).collect::<Result<Vec<_>>>()?;
            let off = (Tensor::cat(&parts, 2)? - one_pass.narrow(2, 0, n)?)?.abs()?.max_all()?.to_scalar::<f64>()?;
            assert!(off < 1e-11, "{preset:?} by {chunk}: {off:e}");
            assert!(read < n_mel, "{preset:?} by {chunk}: {read} spectrogram frames read");
        }
    }
    Ok(())
}

#[test]
fn poses_depend_on_no_sound_beyond_the_look_ahead() -> anyhow::Result<()> {
    for preset in [Preset::Light, Preset::Paper] {
        for secs in [0.25, 0.5, 1.0] {
            let look_ahead = bounded(preset, secs);
            let net = network(preset, Some(look_ahead))?;
            let n_mel = 1100;
            let sound = pattern(&[1, 8, n_mel], 3.0)?;
            let poses = net.forward(&sound, &[], 128, false)?;
            for changed in [401, 444, 530] {
                let kept = sound.narrow(2, 0, changed)?;
                let other = Tensor::cat(&[kept, sound.narrow(2, changed, n_mel - changed)?.affine(1.0, 2.0)?], 2)?;
                let off =
                    (net.forward(&other, &[], 128, false)? - &poses)?.abs()?.max(1)?.squeeze(0)?.to_vec1::<f64>()?;
                let first = off.iter().position(|off| *off > 0.0).unwrap() as f64;
                // The first sound that differs, relative to the pose, in seconds.
                let after = (changed as f64 + look_ahead.shift as f64) / 100.0 - first / 15.0;
                assert!(after + 0.025 <= secs + 1e-9, "{preset:?} {secs}: changed by sound {after} s later");
                assert!(after > secs - 0.25, "{preset:?} {secs}: changed by sound only {after} s later");
            }
        }
    }
    Ok(())
}
