//! Generation by a network with a limited look-ahead.

use crate::fixtures::models::untrained::write_bounded_speaker;
use crate::generate::onnx_export::sound;
use orator_base::types::pose3d::Motion;
use orator_gesture::generate::GestureGenerator;
use std::cell::Cell;

/// Pieces of a sound, of changing length; counts the samples that were taken.
fn pieces<'a>(samples: &'a [f32], n_taken: &'a Cell<usize>) -> impl Iterator<Item = anyhow::Result<Vec<f32>>> + 'a {
    let mut sizes = [1, 333, 160, 2000, 7].into_iter().cycle();
    std::iter::from_fn(move || {
        let first = n_taken.get();
        let end = samples.len().min(first + sizes.next()?);
        n_taken.set(end);
        (first < end).then(|| Ok(samples[first..end].to_vec()))
    })
}

fn difference(a: &Motion, b: &Motion) -> f32 {
    assert_eq!(a.joints.dim(), b.joints.dim());
    a.joints.iter().zip(&b.joints).fold(0.0, |most, (a, b)| (a - b).abs().max(most))
}

#[test]
fn frame_by_frame_equals_the_whole_sound_and_needs_no_later_sound() -> anyhow::Result<()> {
    let dir = tempfile::tempdir()?;
    for secs in [0.25, 0.5, 2.0] {
        let file = dir.path().join(format!("{secs}.safetensors"));
        write_bounded_speaker(&file, secs);
        let generator = GestureGenerator::open(&file)?;
        let sound = sound(23.0);
        let whole = generator.motion(&sound, &[])?;
        let n_taken = Cell::new(0);
        let mut frames = Vec::new();
        for (k, features) in generator.live_features(pieces(&sound.samples, &n_taken), 1)?.take(345).enumerate() {
            let allowed = ((k as f64 / 15.0 + secs) * 16_000.0) as usize + 2000;
            assert!(n_taken.get() <= allowed, "{secs} s: {} samples for frame {k}", n_taken.get());
            frames.push(features?);
        }
        let views: Vec<_> = frames.iter().map(|frame| frame.view()).collect();
        let live = generator.metadata.motion(ndarray::concatenate(ndarray::Axis(1), &views)?.view());
        let off = difference(&live, &whole);
        assert!(off < 1e-4, "{secs} s: {off} m");
        // The network does react to the sound.
        let silence = orator_base::types::sound::Sound { rate: 16_000, samples: vec![0.0; sound.samples.len()] };
        assert!(difference(&generator.motion(&silence, &[])?, &whole) > 1e-3);
    }
    Ok(())
}

#[test]
fn complete_networks_are_refused() -> anyhow::Result<()> {
    let dir = tempfile::tempdir()?;
    let file = dir.path().join("complete.safetensors");
    crate::fixtures::models::untrained::write_untrained_speaker(&file);
    let message = GestureGenerator::open(&file)?.look_ahead().unwrap_err().to_string();
    assert!(message.contains("6.5 s") && message.contains("gan.look_ahead_secs"), "{message}");
    Ok(())
}
