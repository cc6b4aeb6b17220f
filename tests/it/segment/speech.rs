//! Speech activity: the model gives the probabilities of its own package, synthetic non-speech sounds are rejected, and
//! without the model speech is detected by loudness, with a single note.

use crate::fixtures::footage::{FPS, good, write};
use crate::fixtures::onnx_models::speech_model;
use orator_base::stage::artifacts::Artifact;
use orator_base::stage::ledger::Ledger;
use orator_base::stage::progress::Silent;
use orator_base::stage::{Stage, Unit};
use orator_base::types::time::FrameRate;
use orator_dataset::config::{self, Settings, SpeechRule};
use orator_formats::media_json::MediaInfo;
use orator_onnx::ModelError;
use orator_onnx::speech::SpeechModel;
use orator_pipeline::segment::{Measures, SegmentStage, judge};
use orator_pipeline::speech::speech_activity;
use orator_pipeline::speech::speech_rule::SpeechDetector;
use orator_report::videos::thresholds::THRESHOLDS;
use orator_test_support::project::{Project, files_under};
use orator_test_support::skip::real_data;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::fs;
use std::path::Path;

const RATE: usize = 16_000;

/// At most the first `n` samples of a WAV file.
fn utterance(name: &str, n: usize) -> Option<Vec<f32>> {
    let path = real_data(&format!("data/audio/{name}"))?;
    let mut wav = hound::WavReader::open(path).unwrap();
    Some(wav.samples::<i16>().take(n).map(|sample| f32::from(sample.unwrap()) / 32_768.0).collect())
}

fn times(secs: usize) -> impl Iterator<Item = f64> {
    (0..secs * RATE).map(|i| i as f64 / RATE as f64)
}

/// A 120 Hz tone with harmonics, silent in half of every 0.25 s and for two seconds in the middle.
fn syllables() -> Vec<f32> {
    let of = |t: f64| {
        let buzz: f64 = (1..20).map(|k| (TAU * 120.0 * f64::from(k) * t).sin() / f64::from(k)).sum();
        let open = if (2.0..=4.0).contains(&t) { 0.0 } else { (TAU * 4.0 * t).sin().max(0.0) };
        (0.1 * buzz * open) as f32
    };
    times(6).map(of).collect()
}

fn steady_noise() -> Vec<f32> {
    (0..6 * RATE as u64).map(|i| ((((i * 7919) % 100_003) as f64 / 100_003.0 - 0.5) * 0.2) as f32).collect()
}

/// Chords with a melody and a drum.
fn music(secs: usize) -> Vec<f32> {
    let note = |frequency: f64, since: f64, length: f64| -> f64 {
        let tone: f64 = (1..7).map(|k| (TAU * frequency * f64::from(k) * since).sin() / f64::from(k).powf(1.5)).sum();
        if (0.0..length).contains(&since) { tone * (-3.0 * since / length).exp() } else { 0.0 }
    };
    let melody = [220.0, 261.6, 329.6, 440.0, 392.0, 329.6, 261.6, 196.0];
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let of = |t: f64| {
        let (beat, bar) = ((t / 0.5).floor(), (t / 2.0).floor());
        let chord: f64 = [110.0, 138.6, 164.8].iter().map(|f| 0.5 * note(*f, t - 2.0 * bar, 2.0)).sum();
        let drum = if t - 0.5 * beat < 0.06 { rng.random_range(-0.5..0.5) } else { 0.0 };
        (0.15 * (0.6 * note(melody[beat as usize % 8], t - 0.5 * beat, 0.5) + chord + drum)) as f32
    };
    times(secs).map(of).collect()
}

/// Sixty claps per second, each a decaying burst of noise.
fn applause(secs: usize) -> Vec<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut sound = vec![0.0_f32; secs * RATE];
    for _ in 0..60 * secs {
        let (start, loud) = (rng.random_range(0..sound.len() - 800), rng.random_range(0.05..0.3));
        for i in 0..800 {
            sound[start + i] += loud * (-(i as f32) / 150.0).exp() * rng.random_range(-1.0..1.0f32);
        }
    }
    sound
}

/// Five voiced bursts of falling pitch per second.
fn laughter(secs: usize) -> Vec<f32> {
    let of = |t: f64| {
        let (since, pitch) = (t % 0.2, 260.0 - 40.0 * (t % 2.4));
        let formants =
            |f: f64| 1.0 / (1.0 + ((f - 800.0) / 200.0).powi(2)) + 0.7 / (1.0 + ((f - 1300.0) / 250.0).powi(2));
        let voice: f64 = (1..16).map(|k| pitch * f64::from(k)).map(|f| (TAU * f * since).sin() * formants(f)).sum();
        if since < 0.12 { (0.15 * (TAU * since / 0.24).sin() * voice) as f32 } else { 0.0 }
    };
    times(secs).map(of).collect()
}

fn probabilities(model: &mut SpeechModel, sound: &[f32]) -> Vec<f32> {
    sound.chunks(512).map(|window| model.probability(window).unwrap()).collect()
}

#[test]
fn probabilities_agree_with_the_package_on_five_signals() {
    let golden = include_str!("../../../fixtures/reference/speech_activity_golden.json");
    let golden: BTreeMap<String, Vec<f32>> = serde_json::from_str(golden).unwrap();
    let Some((entry, dir, runtime)) = speech_model() else { return };
    assert_eq!(golden.len(), 5);
    for (name, expected) in golden {
        let sound = match name.as_str() {
            "noise" => Some(steady_noise()),
            "syllables" => Some(syllables()),
            utterance_name => utterance(utterance_name, 6 * RATE),
        };
        let Some(sound) = sound else { continue };
        let mut model = SpeechModel::open(&runtime, &entry, &dir).unwrap();
        let found = probabilities(&mut model, &sound);
        assert_eq!(found.len(), expected.len(), "{name}");
        let largest_error = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(largest_error <= 1e-4, "{name}: {largest_error}");
    }
}

/// Ledgers of footage with this audio, judged with and without the model.
fn ledgers(sound: &[f32], settings: &Settings) -> [Ledger; 2] {
    let dir = tempfile::tempdir().unwrap();
    let unit = Unit { speaker: "host".into(), video: "talk-00000000".into(), source: dir.path().join("talk.mp4") };
    let mut footage = good(sound.len() * 15 / RATE);
    footage.sound = Some(sound.iter().map(|sample| (sample.clamp(-1.0, 0.999) * 32_768.0) as i16).collect());
    write(dir.path(), &unit, &footage, "a");
    let detector = SpeechDetector::find(settings).unwrap();
    [detector, None].map(|detector| {
        let stage = SegmentStage::new(&settings.segment, dir.path()).with_speech(detector);
        let out = unit.dir(&dir.path().join(stage.name()));
        fs::create_dir_all(&out).unwrap();
        stage.run(&unit, &out, &Silent).unwrap();
        let first = fs::read(Artifact::Measures.within(&out)).unwrap();
        stage.run(&unit, &out, &Silent).unwrap();
        assert!(fs::read(Artifact::Measures.within(&out)).unwrap() == first, "the output is deterministic");
        Ledger::read(&Artifact::SegmentLedger.path(dir.path(), &unit)).unwrap()
    })
}

fn accepted_share(ledger: &Ledger) -> f64 {
    ledger.accepted_secs() / ledger.duration_secs
}

#[test]
fn music_noise_and_applause_are_rejected_and_speech_over_music_is_not() {
    let Some((_, dir, _)) = speech_model() else { return };
    let mut settings = Settings::default();
    settings.models.dir = dir.clone();
    for (name, sound) in [("music", music(10)), ("noise", steady_noise()), ("applause", applause(10))] {
        let [by_model, loud] = ledgers(&sound, &settings);
        assert!(accepted_share(&loud) > 0.99, "{name} is loud enough");
        assert_eq!(accepted_share(&by_model), 0.0, "{name}");
        let rejected = &by_model.rejected[0];
        assert_eq!(rejected.reason, "no speech");
        assert!(rejected.measured < 0.1 && rejected.threshold == 0.4, "{rejected:?}");
        assert!(
            rejected.message.starts_with("no speech: ") && rejected.message.contains("at least 40 %"),
            "{rejected:?}"
        );
    }
    // Synthetic laughter of voiced bursts is mostly rejected.
    let [by_model, _] = ledgers(&laughter(10), &settings);
    assert!(accepted_share(&by_model) < 0.5, "{by_model:?}");
    let Some(speech) = utterance("ljspeech_LJ001-0003.wav", 9 * RATE) else { return };
    let power = |sound: &[f32]| (sound.iter().map(|s| f64::from(*s).powi(2)).sum::<f64>() / sound.len() as f64).sqrt();
    let music = music(9);
    // Music ten decibels below the voice.
    let gain = (power(&speech) / power(&music) / 10f64.sqrt()) as f32;
    let mixed: Vec<f32> = speech.iter().zip(&music).map(|(speech, music)| speech + gain * music).collect();
    for sound in [&speech, &mixed] {
        let [by_model, loud] = ledgers(sound, &settings);
        assert!((accepted_share(&by_model) - accepted_share(&loud)).abs() < 1e-9, "{:?}", by_model.rejected);
    }
}

#[test]
fn streamed_results_do_not_depend_on_the_thread() {
    let Some((entry, dir, runtime)) = speech_model() else { return };
    let audio = [syllables(), applause(4)].concat();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("audio.wav");
    let spec = hound::WavSpec {
        channels: 1,
        sample_rate: 16_000,
        bits_per_sample: 16,
        sample_format: hound::SampleFormat::Int,
    };
    let mut wav = hound::WavWriter::create(&path, spec).unwrap();
    audio.iter().for_each(|sample| wav.write_sample((sample * 32_768.0) as i16).unwrap());
    wav.finalize().unwrap();
    let shares = || {
        let mut model = SpeechModel::open(&runtime, &entry, &dir).unwrap();
        speech_activity::shares(&path, &mut model, FPS, 160).unwrap().into_iter().map(f32::to_bits).collect::<Vec<_>>()
    };
    let first = shares();
    let all: Vec<Vec<u32>> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4).map(|_| scope.spawn(shares)).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert!(all.iter().all(|shares| *shares == first));
    // Ten seconds of audio at 15 fps; frames after its end are unknown.
    assert!(f32::from_bits(first[149]).is_finite() && f32::from_bits(first[151]).is_nan());
    let mut model = SpeechModel::open(&runtime, &entry, &dir).unwrap();
    let unreadable = speech_activity::shares(Path::new("no.wav"), &mut model, FPS, 3).unwrap();
    assert!(unreadable.iter().all(|share| share.is_nan()));
}

#[test]
fn pauses_are_accepted_and_longer_parts_without_speech_rejected() {
    let judged = |speech: &dyn Fn(usize) -> f32| {
        let footage = good(600);
        let mut measures = Measures::from_keypoints(&footage.keypoints);
        measures.speech = (0..600).map(speech).collect();
        measures.sound_db = vec![-20.0; 600];
        judge(&measures, &MediaInfo::new(40.0, 600, FPS), &config::SegmentConfig::default(), &[])
    };
    let with_pause = |pause: usize| judged(&|t| if (300..300 + pause).contains(&t) { 0.12 } else { 0.8 });
    let (intervals, ledger) = with_pause(45);
    assert_eq!((intervals.intervals.len(), ledger.rejected.len()), (1, 0), "a pause of 3 s");
    let (intervals, ledger) = with_pause(63);
    assert_eq!((intervals.intervals.len(), ledger.rejected.len()), (2, 1));
    let rejected = &ledger.rejected[0];
    assert_eq!(rejected.message, "no speech: 12 % of the sound is speech, at least 40 % are needed");
    assert!((rejected.end_secs - rejected.start_secs - 4.2).abs() < 1e-9);
    let slider = THRESHOLDS.iter().find(|threshold| threshold.key == "min_speech").unwrap();
    let lower = slider.with(&config::SegmentConfig::default(), 0.1);
    let mut measures = Measures::from_keypoints(&good(600).keypoints);
    measures.speech = vec![0.12; 600];
    let accepted = |rules| judge(&measures, &MediaInfo::new(40.0, 600, FPS), rules, &[]).1.accepted_secs();
    assert_eq!(
        (accepted(&config::SegmentConfig::default()), accepted(&lower)),
        (0.0, 40.0),
        "the slider of the report"
    );
    assert_eq!(judged(&|_| f32::NAN).1.rejected.len(), 0, "without the model no frame is rejected for missing speech");
}

#[test]
fn without_the_model_loudness_is_used_and_reported_once() {
    let project = Project::with_clips("speech", 2, 6.0);
    assert!(fs::read_to_string(project.dir().join("pipeline.toml")).unwrap().contains("speech = \"loudness\""));
    let plain = project.run(&[]);
    assert_eq!(plain.code, 0, "{}", plain.errors);
    assert!(!plain.errors.contains("models fetch"), "{}", plain.errors);
    let stage_files = |stage: &str| -> Vec<Vec<u8>> {
        files_under(&project.work().join(stage)).into_iter().map(|(_, path)| fs::read(path).unwrap()).collect()
    };
    let lifted = stage_files("lift");
    let auto = project.run(&["--set", "segment.speech=auto"]);
    assert_eq!(auto.code, 0, "{}", auto.errors);
    assert_eq!(auto.errors.matches("speech is detected by loudness only").count(), 1, "{}", auto.errors);
    assert!(auto.errors.contains("`orator models fetch`"), "{}", auto.errors);
    let facts = auto.json["units"].as_array().unwrap().iter().find(|unit| unit["stage"] == "segment").unwrap();
    assert_eq!(facts["speech"].as_str().or(facts["facts"]["speech"].as_str()), Some("loudness"), "{facts}");
    assert!(stage_files("lift") == lifted);
    let card = fs::read_to_string(project.work().join("dataset/host/README.md")).unwrap();
    assert!(card.contains("Speech was detected by loudness only"), "{card}");
    let vad = project.run(&["--set", "segment.speech=vad"]);
    assert_eq!(vad.code, 1, "{}", vad.errors);
    assert!(
        vad.errors.contains("speech-silero is missing") && vad.errors.contains("orator models fetch"),
        "{}",
        vad.errors
    );
}

#[test]
fn the_rule_depends_on_the_configuration_and_the_installed_model() {
    let dir = tempfile::tempdir().unwrap();
    let mut settings = Settings::default();
    settings.models.dir = dir.path().to_path_buf();
    assert!(SpeechDetector::find(&settings).unwrap().is_none());
    assert!(SpeechDetector::advice(&settings).unwrap().is_some_and(|line| line.contains("orator models fetch")));
    settings.segment.speech = SpeechRule::Vad;
    let error = SpeechDetector::find(&settings).unwrap_err();
    assert!(matches!(error.downcast_ref(), Some(ModelError::Missing { .. })), "{error:#}");
    settings.segment.speech = SpeechRule::Loudness;
    assert!(SpeechDetector::find(&settings).unwrap().is_none() && SpeechDetector::advice(&settings).unwrap().is_none());
    let Some((entry, models, _)) = speech_model() else { return };
    fs::copy(models.join(&entry.file), dir.path().join(&entry.file)).unwrap();
    settings.segment.speech = SpeechRule::Auto;
    let found = SpeechDetector::find(&settings).unwrap().unwrap();
    assert_eq!(found.used().id, "speech-silero");
    assert!(SpeechDetector::advice(&settings).unwrap().is_none());
    // The model is part of the fingerprint, so installing it makes the stage stale.
    let unit = Unit { speaker: "host".into(), video: "talk".into(), source: dir.path().join("talk.mp4") };
    let with = |speech| SegmentStage::new(&settings.segment, dir.path()).with_speech(speech).settings(&unit);
    assert_ne!(with(Some(found)), with(None));
    assert!(FrameRate::new(15, 1) == FPS);
}

#[test]
fn a_damaged_model_is_an_error() {
    let Some((entry, models, runtime)) = speech_model() else { return };
    let dir = tempfile::tempdir().unwrap();
    let mut bytes = fs::read(models.join(&entry.file)).unwrap();
    bytes.truncate(1000);
    fs::write(dir.path().join(&entry.file), bytes).unwrap();
    let error = SpeechModel::open(&runtime, &entry, dir.path()).err().unwrap();
    assert!(matches!(error, ModelError::HashMismatch { .. }), "{error}");
    let mut model = SpeechModel::open(&runtime, &entry, &models).unwrap();
    assert!(model.probability(&[0.0; 513]).is_err());
}
