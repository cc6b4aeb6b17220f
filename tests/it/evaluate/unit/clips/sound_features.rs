//! Tests of `orator_gesture::evaluate::clips::sound_features`.

use orator_base::audio::mel;
use orator_base::audio::onset::Loudest;
use orator_base::types::time::FrameRate;
use orator_gesture::evaluate::clips::sound_features::{SoundFeatureExtractor, SoundFeatures, from_samples};
use orator_gesture::generate::generator::mel_frames;

#[test]
fn features_do_not_depend_on_the_length_of_pieces() {
    let fps = FrameRate::new(15, 1);
    let sound: Vec<f32> =
        (0..400_000).map(|i| (i as f32 * 0.05).sin() * if i % 16_000 < 2000 { 0.5 } else { 0.001 }).collect();
    let mut loudest = Loudest::default();
    loudest.push(&sound);
    let loudest = loudest.finish();
    let features = |piece: usize| {
        let mut extractor = SoundFeatureExtractor::new(fps, Some(loudest));
        sound.chunks(piece).for_each(|samples| extractor.push(samples));
        extractor.finish(375)
    };
    let whole = features(sound.len());
    assert_eq!(whole.rows.len(), 188 * mel::N_MELS);
    assert_eq!(whole, from_samples(&sound, fps, 375));
    assert!(whole.secs == 25.0 && whole.onsets.len() > 15, "{:?}", whole.onsets);
    for piece in [701, 16_000, 160_001] {
        let pieces = features(piece);
        assert_eq!(pieces.onsets, whole.onsets);
        let apart = pieces.rows.iter().zip(&whole.rows).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(pieces.rows.len() == whole.rows.len() && apart < 1e-4, "{piece}: {apart}");
    }
    // Spectrogram of the whole sound, averaged over two motion frames.
    let mels = mel::log_mel(&sound);
    let frames = mel_frames(fps, 20)..mel_frames(fps, 22);
    let mean = mels.slice(ndarray::s![frames, 5]).mean().unwrap();
    assert!((whole.rows[10 * mel::N_MELS + 5] - mean).abs() < 1e-4);
}

#[test]
fn short_sound_is_padded_and_long_sound_is_cut() {
    let fps = FrameRate::new(15, 1);
    let mut extractor = SoundFeatureExtractor::new(fps, None);
    extractor.push(&[0.1; 16_000]);
    assert_eq!(extractor.finish(60).rows.len(), 30 * mel::N_MELS);
    let mut extractor = SoundFeatureExtractor::new(fps, None);
    extractor.push(&[0.1; 64_000]);
    assert_eq!(extractor.finish(15).rows.len(), 8 * mel::N_MELS);
    assert_eq!(SoundFeatureExtractor::new(fps, None).finish(0), SoundFeatures::default());
}
