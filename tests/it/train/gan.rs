//! End-to-end training of the generator on a small synthetic speaker whose arms follow the pitch of a tone: it learns,
//! resumes exactly, stops on divergence, and its checkpoint generates.

use crate::fixtures::faults::stop::{Shared, Stop, bytes};
use crate::fixtures::gesture_dataset::{FPS, dataset, dataset_of, sample, with_posture};
use crate::fixtures::models::training::train_gan;
use crate::fixtures::write_dataset::write_dataset;
use orator_base::stage::progress::Silent;
use orator_base::types::posture::PostureChannel;
use orator_base::types::skeleton::{R_HAND, R_WRIST};
use orator_base::types::sound::Sound;
use orator_dataset::config::GanConfig;
use orator_dataset::config::{AdversarialLoss, GanRecipe, MotionRepresentation, NetworkPreset};
use orator_dataset::{Dataset, Split};
use orator_gesture::generate::GestureGenerator;
use orator_gesture::generate::model::BEST;
use std::panic::AssertUnwindSafe;
use std::path::Path;

fn settings() -> GanConfig {
    let gan = GanConfig {
        recipe: GanRecipe::Rebol2021,
        preset: NetworkPreset::Light,
        representation: MotionRepresentation::Bones,
        adversarial: AdversarialLoss::LeastSquares,
        batch: 2.into(),
        window_frames: 32,
        ..GanConfig::default()
    };
    GanConfig { steps: 6.into(), epoch_steps: 3.into(), checkpoint_every: 2, keep_checkpoints: 2, ..gan }
}

#[test]
fn a_training_stopped_at_a_step_resumes_to_identical_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = dataset(&folder.path().join("dataset"));
    // After a checkpoint and after a validation; with `ORATOR_KILLS` (`make prove`) at every step.
    let stops = if std::env::var("ORATOR_KILLS").is_ok() { vec![1, 2, 3, 4, 5, 6] } else { vec![3, 4] };
    let posed = dataset_of(&folder.path().join("posed"), with_posture);
    let channels = PostureChannel::ALL.to_vec();
    for (name, dataset, stops, settings) in [
        ("bones", &dataset, stops, settings()),
        ("channels", &posed, vec![4], GanConfig { channels, ..settings() }),
        (
            "positions",
            &dataset,
            vec![5],
            GanConfig {
                representation: MotionRepresentation::Positions,
                adversarial: AdversarialLoss::Log,
                lambda_velocity: 0.5,
                ..settings()
            },
        ),
    ] {
        let out = |part: &str| folder.path().join(format!("{name}-{part}"));
        let outcome = train_gan(dataset, &settings, &out("whole"), &Silent).unwrap();
        assert_eq!((outcome.steps, outcome.n_examples, outcome.validation.n_windows), (6, 21, 4));
        assert_eq!(outcome.validation.split, "validation");
        let uninterrupted = bytes(&out("whole"));
        let names: Vec<&str> = uninterrupted.iter().map(|(name, _)| name.as_str()).collect();
        assert!(
            ["metrics.jsonl", BEST, "step-0000004.safetensors", "step-0000006.safetensors"]
                .iter()
                .all(|n| names.contains(n))
        );
        for stop in stops {
            let parts = out(&stop.to_string());
            let progress = Shared(Stop::at(stop));
            let stopped =
                std::panic::catch_unwind(AssertUnwindSafe(|| train_gan(dataset, &settings, &parts, &progress)));
            assert!(stopped.is_err());
            let resumed = train_gan(dataset, &settings, &parts, &Silent).unwrap();
            assert_eq!((resumed.began_at, resumed.steps), ([0, 0, 2, 3, 4, 4][stop as usize - 1], 6));
            for ((name, expected), (_, resumed)) in uninterrupted.iter().zip(bytes(&parts)) {
                assert!(*expected == resumed, "{name} differs after a stop at step {stop}");
            }
        }
    }
}

#[test]
fn settings_of_the_checkpoint_are_used_and_differences_reported() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = dataset(&folder.path().join("dataset"));
    let out = folder.path().join("out");
    train_gan(&dataset, &GanConfig { steps: 3.into(), ..settings() }, &out, &Silent).unwrap();
    let stop = Stop::at(u64::MAX);
    let other = GanConfig {
        learning_rate: 1e-3.into(),
        preset: NetworkPreset::Paper,
        representation: MotionRepresentation::Positions,
        ..settings()
    };
    train_gan(&dataset, &other, &out, &Shared(stop.clone())).unwrap();
    let log = stop.said.lock().unwrap().join("\n");
    for key in ["gan.learning_rate", "gan.preset", "gan.representation"] {
        assert!(log.contains(key), "{log}");
    }
    let uninterrupted = folder.path().join("whole");
    train_gan(&dataset, &settings(), &uninterrupted, &Silent).unwrap();
    let last = |folder: &Path| std::fs::read(orator_formats::checkpoint::path(folder, 6)).unwrap();
    assert!(last(&out) == last(&uninterrupted), "the checkpoint's settings were not used");

    // Another speaker's dataset is rejected; a changed one of the same speaker is reported.
    let other_samples = [
        (Split::Train, sample("d-00000000-000000", 99, 1.0)),
        (Split::Validation, sample("e-00000000-000000", 64, 4.0)),
    ];
    let second = folder.path().join("second");
    write_dataset(&second, "host", FPS, &other_samples).unwrap();
    let stop = Stop::at(u64::MAX);
    let longer = GanConfig { steps: 7.into(), ..settings() };
    train_gan(&Dataset::open(&second).unwrap(), &longer, &out, &Shared(stop.clone())).unwrap();
    assert!(stop.said.lock().unwrap().join("\n").contains("the dataset has changed"));
    let third = folder.path().join("third");
    write_dataset(&third, "guest", FPS, &other_samples).unwrap();
    let error = train_gan(&Dataset::open(&third).unwrap(), &longer, &out, &Silent).unwrap_err();
    assert!(format!("{error:#}").contains("guest"), "{error:#}");
}

#[test]
fn patience_ends_a_training_whose_score_does_not_fall() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = dataset(&folder.path().join("dataset"));
    let out = folder.path().join("out");
    // Steps are too small to change weights; the running statistics of the norms still settle.
    let settings = GanConfig {
        steps: 60.into(),
        epoch_steps: 1.into(),
        patience: 3.into(),
        learning_rate: 1e-20.into(),
        lambda_gan: 0.0.into(),
        ..settings()
    };
    let outcome = train_gan(&dataset, &settings, &out, &Silent).unwrap();
    assert!(outcome.stopped_early && outcome.steps < 60, "{outcome:?}");
    assert_eq!(outcome.steps, outcome.best_step + 3);
    let again = train_gan(&dataset, &settings, &out, &Silent).unwrap();
    assert!(again.stopped_early && again.began_at == outcome.steps);
}

/// Windows of 60 frames, 4 s, are padded inside the network; all losses of `rebol2021` are computed on 60 frames.
#[test]
fn windows_of_60_frames_are_trained_with_all_losses_of_rebol2021() {
    let folder = tempfile::tempdir().unwrap();
    let dataset_folder = folder.path().join("dataset");
    write_dataset(&dataset_folder, "host", FPS, &[(Split::Train, sample("a-00000000-000000", 99, 0.0))]).unwrap();
    let dataset = Dataset::open(&dataset_folder).unwrap();
    let settings = GanConfig {
        recipe: GanRecipe::Rebol2021,
        preset: NetworkPreset::Light,
        window_frames: 60,
        batch: 2.into(),
        steps: 10.into(),
        epoch_steps: 10.into(),
        ..GanConfig::default()
    };
    let out = folder.path().join("out");
    let outcome = train_gan(&dataset, &settings, &out, &Silent).unwrap();
    assert_eq!((outcome.steps, outcome.n_examples), (10, 8));
    let log = std::fs::read_to_string(out.join("metrics.jsonl")).unwrap();
    let lines = log.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
    let step = lines.into_iter().find(|line| line["l1"].is_number()).unwrap_or_else(|| panic!("{log}"));
    for loss in ["l1", "bone", "adversarial", "discriminator"] {
        assert!(step[loss].as_f64().is_some_and(|value| value.is_finite() && value != 0.0), "{loss}: {step}");
    }
    assert!(step["adversarial"].as_f64().unwrap() < 0.0, "log(1 - D) is negative: {step}");
}

#[test]
fn a_few_windows_are_memorised_and_generated() {
    let folder = tempfile::tempdir().unwrap();
    let dataset_folder = folder.path().join("dataset");
    let long = sample("a-00000000-000000", 64 + 7 * 5, 0.0);
    write_dataset(&dataset_folder, "host", FPS, &[(Split::Train, long.clone())]).unwrap();
    let dataset = Dataset::open(&dataset_folder).unwrap();
    let settings = GanConfig {
        recipe: GanRecipe::Rebol2021,
        preset: NetworkPreset::Light,
        representation: MotionRepresentation::Bones,
        adversarial: AdversarialLoss::LeastSquares,
        batch: 4.into(),
        steps: 80.into(),
        learning_rate: 2e-3.into(),
        lambda_gan: 0.0.into(),
        epoch_steps: 1_000.into(),
        checkpoint_every: 1_000,
        ..GanConfig::default()
    };
    let out = folder.path().join("out");
    let outcome = train_gan(&dataset, &settings, &out, &Silent).unwrap();
    let validation = outcome.validation;
    let (generated, mean_pose) = (validation.generator, validation.mean_pose);
    assert_eq!((validation.split.as_str(), outcome.n_examples), ("train", 8));
    let log = std::fs::read_to_string(out.join("metrics.jsonl")).unwrap();
    let l1 = |line: &str| serde_json::from_str::<serde_json::Value>(line).unwrap()["l1"].as_f64();
    assert!(log.lines().filter_map(l1).any(|l1| l1 < 0.1), "{log}");
    assert!(generated.l1 < 0.3 * mean_pose.l1 && generated.pck > mean_pose.pck, "{validation:?}");
    assert!((0.7..1.3).contains(&generated.energy) && generated.frechet < mean_pose.frechet, "{validation:?}");
    assert!(validation.bone_change_mm < 0.01 && validation.alarm.is_none(), "{validation:?}");

    let speaker = GestureGenerator::open(&out).unwrap();
    let motion = speaker.motion(&long.sound, &[]).unwrap();
    assert_eq!((speaker.name(), motion.n_frames()), ("host", 99));
    assert!(motion.joints.iter().all(|v| v.is_finite()));
    for t in 0..99 {
        for k in 0..3 {
            assert_eq!(motion.joints[[t, 0, k]], 0.0);
            assert_eq!(motion.joints[[t, R_HAND, k]], motion.joints[[t, R_WRIST, k]]);
        }
    }
    let short = Sound { rate: 16_000, samples: long.sound.samples[..3_000].to_vec() };
    assert_eq!(speaker.motion(&short, &[]).unwrap().n_frames(), 2);
    let empty = Sound { rate: 16_000, samples: Vec::new() };
    assert!(speaker.motion(&empty, &[]).is_err());
    assert!(speaker.motion(&Sound { rate: 8_000, ..short }, &[]).is_err());
    assert!(GestureGenerator::open(&dataset_folder.join("info.json")).is_err());
}

#[test]
fn a_diverging_training_and_unusable_windows_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = dataset(&folder.path().join("dataset"));
    let out = folder.path().join("out");
    let diverging = GanConfig { learning_rate: 1e30.into(), checkpoint_every: 1, steps: 50.into(), ..settings() };
    let error = format!("{:#}", train_gan(&dataset, &diverging, &out, &Silent).unwrap_err());
    assert!(error.contains("the training diverged") && error.contains("learning_rate"), "{error}");
    let too_long = GanConfig { window_frames: 128, ..settings() };
    assert!(format!("{:#}", train_gan(&dataset, &too_long, &out, &Silent).unwrap_err()).contains("window"));
    assert!(train_gan(&dataset, &GanConfig { window_frames: 31, ..settings() }, &out, &Silent).is_err());
}

#[test]
fn a_resumed_training_removes_leftover_checkpoints() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = dataset(&folder.path().join("dataset"));
    let out = folder.path().join("out");
    train_gan(&dataset, &settings(), &out, &Silent).unwrap();
    let path = |step| orator_formats::checkpoint::path(&out, step);
    assert!(path(4).exists() && path(6).exists());
    std::fs::copy(path(4), path(2)).unwrap();
    train_gan(&dataset, &settings(), &out, &Silent).unwrap();
    assert!(!path(2).exists() && path(4).exists() && path(6).exists());
}
