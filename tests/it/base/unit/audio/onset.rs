//! Tests of `orator_base::audio::onset`.

use orator_base::audio::onset::{Loudest, Onsets, onsets};
use orator_base::types::sound::SAMPLE_RATE;

/// Signal of the reference script: bursts of decaying tones, 6 s.
pub(super) fn bursts() -> Vec<f32> {
    let sample = |i: usize| {
        let t = i as f64 / f64::from(SAMPLE_RATE);
        let burst = |k: usize| {
            let since = t - 0.37 * k as f64 - 0.05 * (k % 3) as f64;
            let hz = 180.0 + 70.0 * (k * k % 11) as f64;
            let tone =
                (std::f64::consts::TAU * hz * since).sin() + 0.3 * (std::f64::consts::TAU * 7.3 * hz * since).sin();
            if since < 0.0 { 0.0 } else { 0.3 * (-9.0 * since).exp() * tone }
        };
        (0..16).map(burst).sum::<f64>() as f32
    };
    (0..6 * SAMPLE_RATE as usize + 100).map(sample).collect()
}

#[test]
fn onsets_equal_those_of_librosa() {
    let golden: serde_json::Value =
        serde_json::from_str(include_str!("../../../../../fixtures/reference/audio_features_golden.json")).unwrap();
    let sound = bursts();
    let list = |name: &str| serde_json::from_value::<Vec<f64>>(golden["onset"][name].clone()).unwrap();
    let mut loudest = Loudest::default();
    loudest.push(&sound);
    let loudest = loudest.finish();
    let mut in_chunks = Onsets::new(loudest);
    sound.chunks(777).for_each(|chunk| in_chunks.push(chunk));
    let strengths = in_chunks.strengths();
    let expected = list("strengths");
    assert_eq!(strengths.len(), expected.len());
    for (i, (found, expected)) in strengths.iter().zip(&expected).enumerate() {
        assert!((f64::from(*found) - expected).abs() < 2e-3 * (1.0 + expected), "{i}: {found} {expected}");
    }
    assert_eq!(onsets(&sound), list("times"));
}

#[test]
fn silence_and_empty_audio_have_no_onsets() {
    assert!(onsets(&[]).is_empty());
    assert!(onsets(&[0.0; 20_000]).is_empty());
    assert!(onsets(&[f32::NAN; 3000]).is_empty());
    assert_eq!(onsets(&[0.1]).len(), 0);
}
