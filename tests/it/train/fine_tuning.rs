//! A training initialised from another speaker's model starts with its weights, uses its own normalisation and
//! skeleton, and lists the videos of both.

use crate::fixtures::faults::stop::{Shared, Stop, bytes};
use crate::fixtures::gesture_dataset::{FPS, sample};
use crate::fixtures::models::training::train_gan;
use crate::fixtures::write_dataset::write_dataset;
use orator_base::stage::progress::Silent;
use orator_dataset::config::{GanConfig, NetworkPreset};
use orator_dataset::{Dataset, Split};
use orator_formats::checkpoint;
use orator_gesture::generate::GestureGenerator;
use orator_gesture::generate::model::BEST;
use orator_gesture::train::epochs::ValidatedStep;
use orator_gesture::train::gan::train::{TrainingStart, train};
use std::path::Path;

fn speaker(folder: &Path, name: &str, phase: f64) -> Dataset {
    let samples = [
        (Split::Train, sample(&format!("{name}-00000000-000000"), 128, phase)),
        (Split::Validation, sample(&format!("{name}-00000001-000000"), 64, phase + 1.0)),
    ];
    let dir = folder.join(name);
    write_dataset(&dir, name, FPS, &samples).unwrap();
    Dataset::open(&dir).unwrap()
}

fn settings() -> GanConfig {
    let gan = GanConfig { batch: 2.into(), window_frames: 32, checkpoint_every: 3, ..GanConfig::default() };
    GanConfig { steps: 6.into(), epoch_steps: 3.into(), ..gan }
}

#[test]
fn weights_are_initialised_and_the_skeleton_is_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let (anna, ben) = (speaker(dir, "anna", 0.0), speaker(dir, "ben", 1.5));
    let of_anna = dir.join("anna-gan");
    train_gan(&anna, &settings(), &of_anna, &Silent).unwrap();
    let stop = Stop::at(u64::MAX);
    let ignore = &mut |_: ValidatedStep| ();
    let of_ben = dir.join("ben-gan");
    train(
        &[&ben],
        &settings(),
        &TrainingStart { from: Some(&of_anna), ..TrainingStart::default() },
        &of_ben,
        &Shared(stop.clone()),
        ignore,
    )
    .unwrap();
    let log = stop.said.lock().unwrap().join("\n");
    assert!(log.contains("initialising from ") && log.contains("(trained on anna)"), "{log}");

    let model = GestureGenerator::open(&of_ben).unwrap().metadata;
    assert_eq!(model.name, "ben");
    let alone = dir.join("ben-alone");
    train_gan(&ben, &settings(), &alone, &Silent).unwrap();
    let own = GestureGenerator::open(&alone).unwrap().metadata;
    assert_eq!((&model.normalisation, &model.representation), (&own.normalisation, &own.representation));
    assert_eq!(own.videos.len(), ben.info().videos.len());
    let speakers: Vec<&str> = model.videos.iter().map(|video| video.speaker.as_str()).collect();
    assert!(speakers.contains(&"anna") && speakers.contains(&"ben"), "{speakers:?}");
    let weights = |out: &Path| std::fs::read(checkpoint::path(out, 3)).unwrap();
    assert!(weights(&of_ben) != weights(&alone), "the initial weights had no effect");

    // A resumed training needs no initial model, and ends with identical bytes.
    let parts = dir.join("ben-parts");
    let half = GanConfig { warmup_steps: 0.into(), final_lr_ratio: 1.0.into(), ..settings() };
    let uninterrupted = dir.join("ben-whole");
    train(
        &[&ben],
        &half,
        &TrainingStart { from: Some(&of_anna), ..TrainingStart::default() },
        &uninterrupted,
        &Silent,
        ignore,
    )
    .unwrap();
    train(
        &[&ben],
        &GanConfig { steps: 3.into(), ..half.clone() },
        &TrainingStart { from: Some(&of_anna), ..TrainingStart::default() },
        &parts,
        &Silent,
        ignore,
    )
    .unwrap();
    train(&[&ben], &half, &TrainingStart::default(), &parts, &Silent, ignore).unwrap();
    let last = |out: &Path| std::fs::read(checkpoint::path(out, 6)).unwrap();
    assert!(last(&uninterrupted) == last(&parts));
    assert!(bytes(&uninterrupted).iter().any(|(name, _)| name == BEST));
}

#[test]
fn unsuitable_initial_models_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let (anna, ben) = (speaker(dir, "anna", 0.0), speaker(dir, "ben", 1.5));
    let fails = |from: &Path, settings: &GanConfig| {
        let result = train(
            &[&ben],
            settings,
            &TrainingStart { from: Some(from), ..TrainingStart::default() },
            &dir.join("out"),
            &Silent,
            &mut |_| (),
        );
        format!("{:#}", result.unwrap_err())
    };
    assert!(fails(&dir.join("nowhere"), &settings()).contains("nowhere"));
    std::fs::create_dir(dir.join("empty")).unwrap();
    assert!(fails(&dir.join("empty"), &settings()).contains("no checkpoint in"));
    let of_anna = dir.join("anna-gan");
    train_gan(&anna, &GanConfig { steps: 2.into(), ..settings() }, &of_anna, &Silent).unwrap();
    let paper = GanConfig { preset: NetworkPreset::Paper, ..settings() };
    let error = fails(&of_anna, &paper);
    assert!(error.contains("gan.preset") && error.contains(BEST), "{error}");
}
