//! Evaluation of a trained speaker on held-out audio, and the page of its training, by the program; and the
//! nearest-neighbour baseline, on a dataset with a known match.

use crate::fixtures::browser::Browser;
use crate::fixtures::gesture_dataset::{dataset, sample};
use crate::fixtures::write_dataset::write_dataset;
use ndarray::s;
use orator_base::types::time::FrameRate;
use orator_dataset::{Dataset, Split};
use orator_gesture::evaluate::baseline::baselines::ClipMotion;
use orator_gesture::evaluate::clips::clips::{EvalClip, EvalClips};
use orator_gesture::evaluate::clips::from_checkpoints::nearest_neighbours;
use orator_gesture::evaluate::clips::held_out;
use orator_gesture::evaluate::clips::motion_store::{MotionStore, StoredMotion};
use orator_gesture::evaluate::clips::sound_features::from_samples;
use orator_gesture::train::gan::speakers::normalisation;
use orator_test_support::project::Project;
use std::path::Path;

#[test]
fn configured_speakers_are_evaluated_by_one_command() {
    let project = Project::with_clips("all-speakers", 0, 1.0);
    let data = project.work().join("dataset/host");
    std::fs::create_dir_all(&data).unwrap();
    dataset(&data);
    let sets = ["gan.batch=2", "gan.epoch_steps=2", "gan.checkpoint_every=2"].map(|set| ["--set", set]).concat();
    let answer = project.answer(&[&["train", "gan", "--steps", "4"], &sets[..]].concat());
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let all = project.answer(&["evaluate", "--speaker", "all", "--split", "validation", "--alpha", "0.2"]);
    assert_eq!(all.code, 0, "{}", all.errors);
    let row = &all.json["speakers"][0];
    let one = project.answer(&[
        "evaluate",
        "--dataset",
        "work/dataset/host",
        "--checkpoint",
        "work/gan/host",
        "--alpha",
        "0.2",
    ]);
    let metrics = one.json["metrics"].as_array().unwrap();
    let is_pck = |metric: &&serde_json::Value| metric["name"] == "pck_3d" && metric["part"] == "all";
    let values = &metrics.iter().find(is_pck).unwrap()["values"];
    for (key, predictor) in [("pck", "prediction"), ("pck_of_mean_pose", "mean_pose")] {
        assert_eq!(row[key].as_array().unwrap().len(), 1, "{row}");
        assert_eq!(row[key][0]["value"], values[predictor]["value"], "{row}");
    }
    assert_eq!((&row["speaker"], &row["pck"][0]["alpha"]), (&"host".into(), &0.2.into()));
    let unknown = project.answer(&["evaluate", "--speaker", "nobody"]);
    assert!(unknown.code == 1 && unknown.errors.contains("expected all or one of host"), "{}", unknown.errors);
}

#[test]
fn a_training_writes_a_page_and_its_speaker_is_evaluated() {
    let project = Project::with_clips("measured", 0, 1.0);
    let (data, out) = (project.dir().join("data"), project.dir().join("gan"));
    dataset(&data);
    let [data, out] = [&data, &out].map(|path| path.to_string_lossy().into_owned());
    let sets = ["gan.batch=2", "gan.epoch_steps=2", "gan.checkpoint_every=2"].map(|set| ["--set", set]).concat();
    let train = [&["train", "gan", "--dataset", &data, "--out", &out, "--steps", "4"], &sets[..]].concat();
    let answer = project.answer(&train);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let page = project.dir().join("gan/training.html");
    assert_eq!(answer.json["page"], page.to_string_lossy().as_ref());
    let bytes = std::fs::read(&page).unwrap();
    check_page(&page);
    // A second call has no steps to train and writes the same page.
    assert_eq!(project.answer(&train).code, 0);
    assert!(bytes == std::fs::read(&page).unwrap(), "the page differs");

    let answer = project.answer(&["evaluate", "--dataset", &data, "--checkpoint", &out]);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let result = &answer.json;
    assert_eq!(result["n_clips"], 1);
    let n_blocks = result["n_blocks"].as_u64().unwrap();
    assert!((1..7).contains(&n_blocks), "{n_blocks}");
    let names: Vec<&str> =
        result["predictors"].as_array().unwrap().iter().map(|row| row["name"].as_str().unwrap()).collect();
    let expected = [
        "prediction",
        "mean_pose",
        "median_pose",
        "nearest_neighbour",
        "mismatched_prediction",
        "mismatched_truth",
        "truth_halves",
        "truth",
    ];
    assert_eq!(names, expected);
    let metrics = result["metrics"].as_array().unwrap();
    let metric = |name: &str| metrics.iter().find(|metric| metric["name"] == name).unwrap();
    let value = |name: &str, row: &str| metric(name)["values"][row]["value"].as_f64().unwrap();
    for row in expected.iter().filter(|row| **row != "truth_halves") {
        assert!((0.0..=1.0).contains(&value("pck_3d", row)) && value("mpjpe", row) >= 0.0, "{row}");
    }
    assert_eq!((value("pck_3d", "truth"), value("mpjpe", "truth")), (1.0, 0.0));
    let sentence = result["better_than_constant_pose"]["sentence"].as_str().unwrap();
    assert!(sentence.contains(&format!("{n_blocks} block")), "{sentence}");
    assert!(sentence.contains("too few for a conclusion (at least 7 are needed); hold out about "), "{sentence}");
    assert!(sentence.ends_with(" s more motion."), "{sentence}");
    let invalid = project.answer(&["evaluate", "--dataset", &data, "--checkpoint", &out, "--split", "test"]);
    assert!(
        invalid.code == 1 && invalid.errors.contains("splits with intervals: train, validation"),
        "{}",
        invalid.errors
    );
}

/// Checks the page in a browser.
fn check_page(page: &Path) {
    let Some(mut browser) = Browser::open(page, [1200, 900]) else { return };
    let mut count = |selector: &str| browser.value(&format!("document.querySelectorAll('{selector}').length"));
    assert_eq!((count(".chart svg"), count("#best tbody tr"), count("img.strip")), (5.into(), 6.into(), 1.into()));
    let flat =
        "[...document.querySelectorAll('svg, .chart path')].filter(e => !(e.getBoundingClientRect().width > 0)).length";
    assert_eq!(browser.value(flat), 0);
    for (width, scheme) in [(360, "dark"), (1200, "light")] {
        browser.resize([width, 800]);
        browser.colours(scheme);
        let wide = browser.value("document.documentElement.scrollWidth").as_u64().unwrap();
        assert!(wide <= u64::from(width), "{wide} px wide in a window of {width} px");
    }
    assert!(browser.problems.is_empty(), "{:?}", browser.problems);
}

#[test]
fn the_nearest_neighbour_by_audio_is_the_copied_interval() {
    let folder = tempfile::tempdir().unwrap();
    let fps = FrameRate::new(15, 1);
    let source = sample("b-00000000-000000", 200, 2.0);
    // Frames 40 to 140 of a training interval are held out as well.
    let mut copy = sample("c-00000000-000000", 100, 0.0);
    copy.motion.joints = source.motion.joints.slice(s![40..140, .., ..]).to_owned();
    copy.motion.mask.fill(true);
    copy.motion.joints[[60, 5, 0]] = copy.motion.joints[[59, 5, 0]];
    copy.sound.samples = source.sound.samples[40 * 16_000 / 15..][..copy.sound.samples.len()].to_vec();
    let samples =
        [(Split::Train, sample("a-00000000-000000", 120, 0.0)), (Split::Train, source), (Split::Validation, copy)];
    write_dataset(folder.path(), "host", fps, &samples).unwrap();
    let dataset = Dataset::open(folder.path()).unwrap();
    let normal = normalisation(&dataset).unwrap();
    let ground_truth =
        held_out::read(&dataset, &held_out::samples(&dataset, Split::Validation).unwrap(), &normal).unwrap();
    let held_out::HeldOutInterval { key, ground_truth, sound, .. } = ground_truth.into_iter().next().unwrap();
    let features = Some(from_samples(&sound.samples, fps, ground_truth.n_frames()));
    let clip = EvalClip {
        name: key,
        predicted: StoredMotion::Held(ground_truth.joints.clone()),
        ground_truth: StoredMotion::Held(ground_truth.joints.clone()),
        mask: ground_truth.mask,
        features,
        audio: None,
    };
    let clips = EvalClips { fps, clips: vec![clip], notes: Vec::new(), trained_on: false, channels: Vec::new() };
    let found =
        nearest_neighbours(&dataset, &normal, &clips, Split::Validation, &MotionStore::in_memory()).unwrap().unwrap();
    let ClipMotion::Motion(found) = &found[0] else { panic!("a motion") };
    let n_different = found.view().iter().zip(&ground_truth.joints).filter(|(a, b)| (*a - *b).abs() > 1e-3).count();
    assert!(n_different < found.view().len() / 20, "{n_different} of {} numbers differ", found.view().len());
}
