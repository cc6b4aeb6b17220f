//! Tests of `orator_study::stimuli::filmed_speaker`.

use orator_base::audio::loudness;
use orator_base::types::sound::Sound;
use orator_study::stimuli::filmed_speaker::{LOUDNESS_LUFS, normalise_loudness, tones};

#[test]
fn audio_is_normalised_without_clipping() {
    let noise = |gain: f32, peak: f32| {
        let mut samples: Vec<f32> =
            (0..48_000u64).map(|i| gain * ((i * i * 7_919 % 2_003) as f32 / 1_001.5 - 1.0)).collect();
        samples[24_000] = peak;
        Sound { rate: 16_000, samples }
    };
    for (peak, expected) in [(0.05, LOUDNESS_LUFS..LOUDNESS_LUFS + 0.01), (1.0, -45.0..LOUDNESS_LUFS)] {
        let mut sounds = [noise(0.3, 0.3), noise(0.02, 0.02), noise(0.01, peak)];
        let target = normalise_loudness(sounds.iter_mut());
        assert!(expected.contains(&target), "{target}");
        for sound in &sounds {
            assert!((loudness::integrated(sound).unwrap() - target).abs() < 0.2);
            assert!(sound.samples.iter().all(|v| v.abs() <= 0.901));
        }
    }
    let mut silent = [Sound { rate: 16_000, samples: vec![0.0; 16_000] }];
    assert_eq!(normalise_loudness(silent.iter_mut()), LOUDNESS_LUFS);
    assert!(silent[0].samples.iter().all(|v| *v == 0.0));
}

#[test]
fn the_number_of_tones_is_correct_for_any_length() {
    for secs in [1, 12] {
        let sound = tones(3, 16_000, 16_000 * secs);
        // Whether each step of 20 ms is loud.
        let loud: Vec<bool> = sound.samples.chunks(320).map(|step| step.iter().any(|v| v.abs() > 0.05)).collect();
        let n_begun = loud.windows(2).filter(|pair| !pair[0] && pair[1]).count();
        assert_eq!((n_begun, loud[0], loud[loud.len() - 1]), (3, false, false));
    }
    assert!(tones(0, 16_000, 100).samples.iter().all(|v| *v == 0.0));
    assert!(tones(3, 16_000, 0).samples.is_empty());
}
