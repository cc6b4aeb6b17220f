//! Tests of `orator_base::audio::pauses`.

use orator_base::audio::pauses::{FLOOR_DB, SpeechLevel};
use orator_base::types::sound::Sound;

#[test]
fn a_pause_is_far_below_speech_at_any_gain() {
    for gain in [1.0, 0.02] {
        let loud = |i: usize| if (8_000..12_000).contains(&(i % 16_000)) { 0.0 } else { gain * 0.5 };
        let samples = (0..64_000).map(|i| loud(i) * if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let level = SpeechLevel::of(&Sound { rate: 16_000, samples });
        assert!(level.around(0.625) < -40.0 && level.around(1.625) < -40.0);
        assert!(level.around(0.2).abs() < 0.1 && level.around(0.52).abs() < 0.1);
        assert!((level.speech_share(0.0..4.0) - 0.75).abs() < 0.02);
        assert_eq!(level.speech_ranges(0.2).len(), 5);
        assert_eq!((level.around(-1.0), level.around(9.0)), (FLOOR_DB, FLOOR_DB));
    }
    assert_eq!(SpeechLevel::of(&Sound { rate: 16_000, samples: Vec::new() }).speech_share(0.0..1.0), 0.0);
}
