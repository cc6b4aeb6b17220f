//! Unit tests of `orator_base::types::sound`.

use orator_base::types::sound::{SoundOffset, sample_at, samples_of};
use orator_base::types::time::FrameRate;

#[test]
fn samples_and_frames_align_in_time() {
    let fps = FrameRate::new(15, 1);
    assert_eq!(samples_of(fps, 16_000, 0..15), 0..16_000);
    assert_eq!(sample_at(fps, 16_000, 1), 1_067);
    let ntsc = FrameRate::new(15_000, 1_001);
    for frame in 0..2_000 {
        let exact = ntsc.secs(frame) * 16_000.0;
        assert!((sample_at(ntsc, 16_000, frame) as f64 - exact).abs() <= 0.5 + 1e-6);
    }
    assert_eq!(sample_at(fps, 16_000, 15 * 3_600 * 24), 16_000 * 3_600 * 24);
}

#[test]
fn offset_prints_direction_and_reliability() {
    let offset = SoundOffset { secs: 0.12, correlation: 0.5, confidence: 0.999, compared_secs: 60.0 };
    assert_eq!((offset.to_string().as_str(), offset.is_reportable()), ("audio is 120 ms late (reliable)", true));
    let offset = SoundOffset { secs: -0.02, confidence: 0.5, ..offset };
    assert_eq!((offset.to_string().as_str(), offset.is_reportable()), ("audio is 20 ms early (uncertain)", false));
    assert!(!SoundOffset { secs: 0.73, confidence: 1.0, ..offset }.is_reliable());
}
