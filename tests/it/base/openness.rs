//! Openness of the mouth by sound.

use orator_base::audio::openness::{Openness, OpennessMeter};
use std::f64::consts::TAU;

/// Half seconds of tones, each part with its frequencies and amplitude.
fn tones(parts: &[(&[f64], f64)]) -> Vec<f32> {
    let tone = |(hz, loud): &(&[f64], f64)| {
        let (hz, loud) = (hz.to_vec(), *loud);
        (0..8000).map(move |n| {
            let secs = f64::from(n) / 16_000.0;
            (loud * hz.iter().map(|hz| (TAU * hz * secs).sin()).sum::<f64>()) as f32
        })
    };
    parts.iter().flat_map(tone).collect()
}

fn measured(samples: &[f32], chunk: usize) -> Openness {
    let mut meter = OpennessMeter::default();
    samples.chunks(chunk).for_each(|chunk| meter.push(chunk));
    meter.finish()
}

#[test]
fn open_vowels_exceed_murmur_hiss_and_silence_at_any_loudness() {
    let (open, murmur, hiss): (&[f64], &[f64], &[f64]) =
        (&[150.0, 400.0, 800.0, 1200.0, 2500.0, 4000.0], &[150.0, 400.0], &[6000.0, 7000.0]);
    let parts = [(open, 0.1), (murmur, 0.1), (open, 0.02), (hiss, 0.1), (open, 0.1), (open, 0.0)];
    let sound = measured(&tones(&parts), 1000);
    let [first, murmur, soft, hiss, again, silence] = [0.25, 0.75, 1.25, 1.75, 2.25, 2.75].map(|at| sound.at(at));
    assert!((first - again).abs() < 0.1 && soft > murmur + 20.0, "{first} {again} {soft} {murmur}");
    for closed in [murmur, hiss, silence] {
        assert!(closed < first - 10.0, "{closed} {first}");
    }
    assert!(sound.at(-0.1).is_nan() && sound.at(3.1).is_nan() && Openness::default().at(0.0).is_nan());
}

#[test]
fn chunks_of_any_length_give_equal_results() {
    let samples = tones(&[(&[300.0, 900.0], 0.1), (&[200.0], 0.2)]);
    assert_eq!(measured(&samples, 7), measured(&samples, 100_000));
    assert_eq!(measured(&samples[..500], 100), Openness::default());
}
