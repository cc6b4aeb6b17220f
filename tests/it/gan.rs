//! The generator's training end to end on a small made-up speaker whose arms follow the pitch of a tone: it learns,
//! resumes exactly, stops when it breaks, and its checkpoint generates.

use ndarray::{Array2, Array3};
use orator::config::Gan;
use orator::dataset::{Dataset, Sample, Split, sync, write_dataset};
use orator::generate::Speaker;
use orator::stage::progress::Silent;
use orator::train::gan::{BEST, train};
use orator::types::pose3d::Motion;
use orator::types::skeleton::{N_JOINTS, R_HAND, R_WRIST, parent};
use orator::types::sound::Sound;
use orator::types::time::FrameRate;
use std::f64::consts::TAU;
use std::path::Path;

const FPS: FrameRate = FrameRate::new(15, 1);

/// An interval whose tone and pose follow one slow curve.
fn sample(key: &str, n_frames: usize, phase: f64) -> Sample {
    let curve = |secs: f64| (TAU * 0.23 * secs + phase).sin() + 0.5 * (TAU * 0.61 * secs + 2.0 * phase).sin();
    let mut joints = Array3::<f32>::zeros((n_frames, N_JOINTS, 3));
    for t in 0..n_frames {
        for joint in 1..N_JOINTS {
            let from = parent(joint).unwrap_or(0);
            let angle = 0.4 * joint as f64 + 0.8 * curve(FPS.secs(t));
            let length = if joint == 7 || joint == R_HAND { 0.0 } else { 0.05 + 0.002 * joint as f64 };
            for (k, direction) in [angle.cos(), angle.sin(), 0.2].into_iter().enumerate() {
                joints[[t, joint, k]] = joints[[t, from, k]] + (length * direction) as f32;
            }
        }
    }
    let mut turn = 0.0;
    let samples = (0..sync::sample_at(FPS, 16_000, n_frames)).map(|i| {
        turn += TAU * (600.0 + 250.0 * curve(i as f64 / 16_000.0)) / 16_000.0;
        0.3 * turn.sin() as f32
    });
    let sound = Sound { rate: 16_000, samples: samples.collect() };
    let mut mask = Array2::from_elem((n_frames, N_JOINTS), true);
    mask.row_mut(n_frames / 2).fill(false);
    joints[[n_frames / 2, 5, 0]] = f32::NAN;
    let pose2d = Array3::zeros((n_frames, 59, 3));
    Sample { key: key.into(), motion: Motion { fps: FPS, joints, mask }, pose2d, sound, meta: serde_json::json!({}) }
}

fn dataset(folder: &Path) -> Dataset {
    let samples = [
        (Split::Train, sample("a-00000000-000000", 99, 0.0)),
        (Split::Train, sample("b-00000000-000000", 64, 2.0)),
        (Split::Validation, sample("c-00000000-000000", 128, 4.0)),
    ];
    write_dataset(folder, "host", FPS, &samples).unwrap();
    Dataset::open(folder).unwrap()
}

fn settings() -> Gan {
    Gan { batch: 2, steps: 6, checkpoint_every: 2, keep_checkpoints: 2, ..Gan::default() }
}

fn bytes(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
    files.iter().map(|path| (name(path), std::fs::read(path).unwrap())).collect()
}

#[test]
fn an_interrupted_training_ends_with_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = dataset(&folder.path().join("dataset"));
    let (whole, parts) = (folder.path().join("whole"), folder.path().join("parts"));
    let outcome = train(&dataset, &settings(), &whole, &Silent).unwrap();
    assert_eq!((outcome.steps, outcome.n_windows, outcome.validation.n_windows), (6, 9, 2));
    assert_eq!(outcome.validation.split, "validation");

    train(&dataset, &Gan { steps: 3, ..settings() }, &parts, &Silent).unwrap();
    // Killed after step 3 was logged but before it was saved: the checkpoint of step 2 is the newest.
    std::fs::remove_file(orator::train::checkpoint::path(&parts, 3)).unwrap();
    let resumed = train(&dataset, &settings(), &parts, &Silent).unwrap();
    assert_eq!((resumed.began_at, resumed.steps), (2, 6));
    let names: Vec<String> = bytes(&whole).into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, [BEST, "metrics.jsonl", "step-0000004.safetensors", "step-0000006.safetensors"]);
    for ((name, whole), (_, parts)) in bytes(&whole).into_iter().zip(bytes(&parts)) {
        assert!(whole == parts, "{name} differs");
    }

    let other = train(&dataset, &Gan { learning_rate: 1e-3, ..settings() }, &parts, &Silent);
    assert!(format!("{:#}", other.unwrap_err()).contains("settings"));
}

#[test]
fn a_few_windows_are_learnt_by_heart_and_spoken() {
    let folder = tempfile::tempdir().unwrap();
    let dataset_folder = folder.path().join("dataset");
    let long = sample("a-00000000-000000", 64 + 7 * 5, 0.0);
    write_dataset(&dataset_folder, "host", FPS, &[(Split::Train, long.clone())]).unwrap();
    let dataset = Dataset::open(&dataset_folder).unwrap();
    let settings =
        Gan { batch: 6, steps: 80, learning_rate: 2e-3, lambda_gan: 0.0, checkpoint_every: 1_000, ..Gan::default() };
    let out = folder.path().join("out");
    let outcome = train(&dataset, &settings, &out, &Silent).unwrap();
    let figures = outcome.validation;
    assert_eq!((figures.split.as_str(), outcome.n_windows), ("train", 8));
    let log = std::fs::read_to_string(out.join("metrics.jsonl")).unwrap();
    let l1 = |line: &str| serde_json::from_str::<serde_json::Value>(line).unwrap()["l1"].as_f64();
    assert!(log.lines().filter_map(l1).any(|l1| l1 < 0.05), "{log}");
    assert!(figures.generator.l1 < 0.3 * figures.mean_pose.l1, "{figures:?}");
    assert!(figures.generator.pck > figures.mean_pose.pck, "{figures:?}");

    let speaker = Speaker::open(&out).unwrap();
    let motion = speaker.motion(&long.sound).unwrap();
    assert_eq!((speaker.name(), motion.n_frames()), ("host", 99));
    assert!(motion.joints.iter().all(|v| v.is_finite()));
    for t in 0..99 {
        for k in 0..3 {
            assert_eq!(motion.joints[[t, 0, k]], 0.0);
            assert_eq!(motion.joints[[t, R_HAND, k]], motion.joints[[t, R_WRIST, k]]);
        }
    }
    let short = Sound { rate: 16_000, samples: long.sound.samples[..3_000].to_vec() };
    assert_eq!(speaker.motion(&short).unwrap().n_frames(), 2);
    let nothing = Sound { rate: 16_000, samples: Vec::new() };
    assert!(speaker.motion(&nothing).is_err());
    assert!(speaker.motion(&Sound { rate: 8_000, ..short }).is_err());
    assert!(Speaker::open(&dataset_folder.join("info.json")).is_err());
}

#[test]
fn a_training_that_explodes_keeps_its_last_good_checkpoint() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = dataset(&folder.path().join("dataset"));
    let out = folder.path().join("out");
    let wild = Gan { learning_rate: 1e30, checkpoint_every: 1, steps: 50, ..settings() };
    let error = format!("{:#}", train(&dataset, &wild, &out, &Silent).unwrap_err());
    assert!(error.contains("the training broke") && error.contains("learning_rate"), "{error}");
    let none = Gan { window_frames: 128, ..settings() };
    assert!(format!("{:#}", train(&dataset, &none, &out, &Silent).unwrap_err()).contains("window"));
    assert!(train(&dataset, &Gan { window_frames: 50, ..settings() }, &out, &Silent).is_err());
}
