//! Mel spectrograms compared with golden values.

use orator_base::audio::mel::{FLOOR, log_mel, n_frames, n_samples};

#[derive(serde::Deserialize)]
struct Golden {
    n_frames: usize,
    rows: Vec<(usize, Vec<f32>)>,
}

/// Signal of `fixtures/reference/mel_reference.py`: a rising tone, a steady tone, and a hash as noise.
fn signal(n: usize) -> Vec<f32> {
    let tau = std::f64::consts::TAU;
    let value = |i: usize| {
        let t = i as f64 / 16_000.0;
        let noise = ((i * 7919) % 1009) as f64 / 1009.0 - 0.5;
        0.4 * (tau * (200.0 + 700.0 * t) * t).sin() + 0.2 * (tau * 440.0 * t).sin() + 0.05 * noise
    };
    (0..n).map(|i| value(i) as f32).collect()
}

#[test]
fn spectrogram_equals_the_reference() -> anyhow::Result<()> {
    let golden: Golden = serde_json::from_str(include_str!("../../../fixtures/reference/mel_golden.json"))?;
    let mels = log_mel(&signal(67_267));
    assert_eq!((mels.nrows(), golden.n_frames), (418, 418));
    for (row, expected) in golden.rows {
        let worst = mels.row(row).iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-3, "row {row}: {worst}");
    }
    Ok(())
}

#[test]
fn short_audio_has_no_frames_and_silence_is_the_floor() {
    assert_eq!(log_mel(&[0.0; 399]).nrows(), 0);
    assert!(log_mel(&[0.0; 800]).iter().all(|v| (*v - FLOOR.ln()).abs() < 1e-6));
    assert_eq!(n_frames(n_samples(427)), 427);
}
