//! Sounds of video files.

use orator_base::types::time::FrameRate;
use orator_pipeline::sound::{levels, loud_ranges};
use std::path::Path;

#[test]
fn levels_of_a_tone_quiet_and_silence_are_measured() {
    let path = tempfile::tempdir().unwrap().keep().join("tone.wav");
    let spec = hound::WavSpec {
        channels: 1,
        sample_rate: 16_000,
        bits_per_sample: 16,
        sample_format: hound::SampleFormat::Int,
    };
    let mut wav = hound::WavWriter::create(&path, spec).unwrap();
    for n in 0..16_000 * 6 {
        let amplitude = if n < 48_000 { 0.1 } else { 0.0001 };
        wav.write_sample((amplitude * 32_768.0 * (f64::from(n) * 0.3).sin()).round() as i16).unwrap();
    }
    wav.finalize().unwrap();
    let (has_audio, db) = levels(&path, FrameRate::new(15, 1), 100).unwrap();
    assert_eq!(has_audio.iter().sum::<f32>(), 90.0);
    assert!((db[20] + 23.0).abs() < 0.1, "{}", db[20]);
    assert!((db[70] + 83.0).abs() < 3.0, "{}", db[70]);
    assert_eq!(db[99], -120.0);
    assert_eq!(levels(Path::new("no.wav"), FrameRate::new(15, 1), 2).unwrap(), (vec![0.0; 2], vec![-120.0; 2]));
    std::fs::remove_dir_all(path.parent().unwrap()).unwrap();
}

#[test]
fn loud_ranges_leave_out_silence() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("speech.wav");
    // Speech from 5 s to 6 s, and from 7 s to 8 s 30 dB softer; noise of -80 dB elsewhere.
    let amplitude = |secs: usize| [0.0001, 0.1, 0.003][usize::from(secs == 5) + 2 * usize::from(secs == 7)];
    let samples = (0..20 * 16_000).map(|n| amplitude(n / 16_000) * (n as f32 * 0.3).sin());
    let sound = orator_base::types::sound::Sound { rate: 16_000, samples: samples.collect() };
    orator_formats::wav::write(&path, &sound).unwrap();
    let found = loud_ranges(&path).unwrap();
    assert!(found.len() == 1 && (found[0].start - 4.6).abs() < 1e-9, "{found:?}");
    assert!((found[0].end - 8.4).abs() < 1e-9, "{found:?}");
    orator_formats::wav::write(&path, &orator_base::types::sound::Sound { samples: vec![0.0; 32_000], ..sound })
        .unwrap();
    assert!(loud_ranges(&path).unwrap().is_empty());
}
