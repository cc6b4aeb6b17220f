//! The extract stage on generated and on real clips: output files, shot boundaries, errors.

use crate::fixtures::clips;
use crate::fixtures::clips::write_numbered;
use ndarray::Array1;
use ndarray_npy::NpzReader;
use orator_base::stage::progress::Silent;
use orator_base::stage::{Report, Stage, Unit};
use orator_base::types::time::FrameRate;
use orator_dataset::config;
use orator_pipeline::extract::ExtractStage;
use orator_test_support::project::files_under;
use orator_test_support::skip::real_data;
use std::fs::{self, File};
use std::path::Path;

fn run(video: &Path, out: &Path, settings: &config::ExtractConfig) -> anyhow::Result<Report> {
    fs::create_dir_all(out)?;
    let unit = Unit { speaker: "host".into(), video: "clip".into(), source: video.to_owned() };
    ExtractStage::new(settings).run(&unit, out, &Silent)
}

fn array<T: ndarray_npy::ReadableElement>(out: &Path, name: &str) -> Vec<T> {
    let mut npz = NpzReader::new(File::open(out.join("timeline.npz")).unwrap()).unwrap();
    let array: Array1<T> = npz.by_name(name).unwrap();
    array.into_iter().collect()
}

/// Frames that begin a shot.
fn cuts(out: &Path) -> Vec<usize> {
    let scores = array::<f64>(out, "shot_score");
    let threshold = config::SegmentConfig::default().shot_threshold;
    (0..scores.len()).filter(|n| scores[*n] >= threshold).collect()
}

fn media(out: &Path) -> serde_json::Value {
    serde_json::from_slice(&fs::read(out.join("media.json")).unwrap()).unwrap()
}

#[test]
fn a_clip_with_audio_gives_all_files_with_deterministic_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let audio = clips::tone(44_100, 2.0, 440.0);
    let video = write_numbered(dir.path(), "in.mp4", 20, FrameRate::new(10, 1), Some(&audio));
    let settings = config::ExtractConfig { keep_frames: true, ..Default::default() };
    let [a, b] = ["a", "b"].map(|name| dir.path().join(name));
    let report = run(&video, &a, &settings).unwrap();
    run(&video, &b, &settings).unwrap();
    assert!(report.line.starts_with("30 frames at 15 fps, ") && report.line.ends_with("2.0 s of audio"));

    let repeated = array::<bool>(&a, "repeated");
    assert_eq!((repeated.len(), repeated.iter().filter(|r| **r).count()), (30, 10));
    let source_secs = array::<f64>(&a, "source_secs");
    assert!((source_secs[2] - 0.1).abs() < 1e-9 && (source_secs[29] - 1.9).abs() < 1e-9);
    let (scores, restarts) = (array::<f64>(&a, "shot_score"), array::<bool>(&a, "restart"));
    assert!(scores.len() == 30 && restarts.len() == 30 && (0..30).all(|t| !restarts[t] || scores[t] > 0.0));
    let difference = array::<f32>(&a, "still");
    assert!((0..30).all(|t| (difference[t] > 0.0) == (t > 0 && !repeated[t])), "{difference:?}");
    let media = media(&a);
    assert_eq!(
        (&media["n_frames"], &media["codec"], &media["image_size"]),
        (&30.into(), &"h264".into(), &[128, 64][..].into())
    );
    assert_eq!(
        (&media["fps"]["num"], &media["source_fps"]["num"], &media["damage"]),
        (&15.into(), &10.into(), &serde_json::Value::Null)
    );
    let wav = hound::WavReader::open(a.join("audio.wav")).unwrap();
    assert_eq!((wav.spec().sample_rate, wav.spec().channels, wav.spec().bits_per_sample), (16_000, 1, 16));
    assert_eq!(fs::read_dir(a.join("frames")).unwrap().count(), 30);
    for name in ["timeline.npz", "media.json", "audio.wav", "frames/000029.png"] {
        assert_eq!(fs::read(a.join(name)).unwrap(), fs::read(b.join(name)).unwrap(), "{name}");
    }
}

#[test]
fn one_frame_without_audio_is_enough() {
    let dir = tempfile::tempdir().unwrap();
    let video = write_numbered(dir.path(), "in.mp4", 1, FrameRate::new(30, 1), None);
    let out = dir.path().join("out");
    assert_eq!(
        run(&video, &out, &config::ExtractConfig::default()).unwrap().line,
        "1 frame at 15 fps, 0 cuts, no audio"
    );
    assert!(!out.join("audio.wav").exists());
    assert_eq!(media(&out)["has_audio"], false);
}

#[test]
fn a_truncated_video_gives_its_readable_part_and_a_damage_note() {
    let dir = tempfile::tempdir().unwrap();
    let audio = clips::tone(16_000, 8.0, 440.0);
    let video = write_numbered(dir.path(), "in.mp4", 240, FrameRate::new(30, 1), Some(&audio));
    let bytes = fs::read(&video).unwrap();
    fs::write(&video, &bytes[..bytes.len() / 2]).unwrap();
    let out = dir.path().join("out");
    let report = run(&video, &out, &config::ExtractConfig::default()).unwrap();
    let n_frames = media(&out)["n_frames"].as_u64().unwrap();
    assert!((20..110).contains(&n_frames) && report.facts["damage"].is_string(), "{}", report.line);
    let secs = media(&out)["audio_secs"].as_f64().unwrap();
    assert!((2.0..6.0).contains(&secs), "{secs} s of audio");
}

#[test]
fn a_file_that_is_not_a_video_is_an_error_with_its_name() {
    let dir = tempfile::tempdir().unwrap();
    let video = dir.path().join("words.mp4");
    fs::write(&video, "These are words.").unwrap();
    let error = format!("{:#}", run(&video, &dir.path().join("out"), &config::ExtractConfig::default()).unwrap_err());
    assert!(error.contains("words.mp4") && error.contains("not a media file"), "{error}");
}

#[test]
fn exactly_the_cuts_of_real_clips_are_detected() {
    let Some(videos) = real_data("data/videos") else { return };
    let dir = tempfile::tempdir().unwrap();
    let clips = files_under(&videos);
    let clips: Vec<_> = clips.iter().filter(|(name, _)| name.ends_with(".mp4") || name.ends_with(".mkv")).collect();
    assert!(clips.len() > 15, "{}", clips.len());
    for (name, video) in &clips {
        for fps in if name.contains("tyson") { &[15, 10][..] } else { &[15] } {
            let settings = config::ExtractConfig { fps: *fps, ..Default::default() };
            // This clip has cuts at 11.60 s and 16.97 s; every other clip is one shot.
            let cut_secs: &[f64] = if name.contains("tyson") { &[11.60, 16.97] } else { &[] };
            let out = dir.path().join(format!("{}-{fps}", name.replace('/', "_")));
            run(video, &out, &settings).unwrap();
            let (scores, found) = (array::<f64>(&out, "shot_score"), cuts(&out));
            let others = scores.iter().enumerate().filter(|(n, _)| !found.contains(n)).map(|(_, s)| *s);
            eprintln!("{name} at {fps}: cuts {found:?}, others below {:.3}", others.fold(0.0, f64::max));
            let near = |(n, secs): (&usize, &f64)| (*n as f64 - secs * f64::from(*fps)).abs() <= 1.0;
            assert!(found.len() == cut_secs.len() && found.iter().zip(cut_secs).all(near), "{name}: {found:?}");
        }
    }
}
