//! Head and trunk channels: they are trained on audio, generated and evaluated; without them nothing changes.

use crate::fixtures::faults::stop::bytes;
use crate::fixtures::gesture_dataset::{FPS, dataset, dataset_of, sample, with_posture};
use crate::fixtures::models::training::train_gan;
use crate::fixtures::write_dataset::write_dataset;
use orator::Evaluation;
use orator_base::stage::progress::Silent;
use orator_base::types::posture::PostureChannel;
use orator_dataset::config::{AdversarialLoss, GanConfig, GanRecipe, MotionRepresentation, NetworkPreset};
use orator_dataset::{Dataset, Split};
use orator_formats::checkpoint;
use orator_gesture::evaluate::clips::checkpoint::EvaluatedCheckpoint;
use orator_gesture::evaluate::clips::motion_store::MotionStore;
use orator_gesture::evaluate::table::result;
use orator_gesture::generate::GestureGenerator;
use orator_gesture::generate::model::BEST;
use orator_gesture::metrics::settings::MetricSettings;

/// Settings of a training that takes seconds.
fn settings(channels: &[PostureChannel]) -> GanConfig {
    GanConfig {
        channels: channels.to_vec(),
        recipe: GanRecipe::Rebol2021,
        preset: NetworkPreset::Light,
        representation: MotionRepresentation::Bones,
        adversarial: AdversarialLoss::LeastSquares,
        batch: 4.into(),
        window_frames: 32,
        steps: 120.into(),
        learning_rate: 2e-3.into(),
        lambda_gan: 0.15.into(),
        epoch_steps: 1_000.into(),
        checkpoint_every: 1_000,
        ..GanConfig::default()
    }
}

#[test]
fn head_and_trunk_follow_held_out_audio() {
    let folder = tempfile::tempdir().unwrap();
    let phases = [0.0, 0.7, 1.5, 2.2, 3.0, 3.8, 4.6, 5.5];
    let mut samples: Vec<_> = phases
        .into_iter()
        .enumerate()
        .map(|(n, phase)| (Split::Train, with_posture(sample(&format!("a{n}-00000000-000000"), 128, phase), phase)))
        .collect();
    let held_out = with_posture(sample("v-00000000-000000", 150, 1.1), 1.1);
    samples.push((Split::Validation, held_out.clone()));
    let dataset_folder = folder.path().join("dataset");
    write_dataset(&dataset_folder, "host", FPS, &samples).unwrap();
    let dataset = Dataset::open(&dataset_folder).unwrap();
    let out = folder.path().join("out");
    let outcome = train_gan(&dataset, &settings(&PostureChannel::ALL), &out, &Silent).unwrap();
    let errors = &outcome.validation.channels;
    assert_eq!(errors.keys().copied().collect::<Vec<_>>(), PostureChannel::ALL);
    assert!(errors.values().all(|of| of.generator < 0.5 * of.mean_pose), "{errors:?}");

    let speaker = GestureGenerator::open(&out).unwrap();
    let (motion, posture) = speaker.motion_and_posture(&held_out.sound, &[]).unwrap();
    let posture = posture.unwrap();
    assert_eq!((motion.n_frames(), posture.head.dim(), posture.trunk.dim()), (150, (150, 3), (150, 3)));
    assert!(posture.head.iter().chain(&posture.trunk).all(|v| v.is_finite()));

    let checkpoints = [EvaluatedCheckpoint::from(speaker)];
    let evaluation =
        Evaluation::of_generators(&dataset, &checkpoints, Split::Validation, &MotionStore::in_memory(), &Silent)
            .unwrap();
    let table = evaluation.measure(&MetricSettings::default(), &Silent).unwrap();
    let result = result::json(&table);
    for channel in ["head", "trunk"] {
        let metric = |name: &str| {
            let mut metrics = result["metrics"].as_array().unwrap().iter();
            metrics.find(|metric| metric["name"] == name && metric["part"] == channel).unwrap()
        };
        let value = |name: &str, source: &str| metric(name)["values"][source]["value"].as_f64();
        let error = |source: &str| value("angle_error", source).unwrap();
        assert!(error("prediction") < 0.5 * error("mean_pose"), "{}", metric("angle_error"));
        // The tone repeats, so that copying the nearest neighbour is hard to beat; it is better than the mean pose.
        assert!(error("nearest_neighbour") < error("mean_pose"), "{}", metric("angle_error"));
        assert!(error("prediction") < error("mismatched_prediction") && error("truth") == 0.0);
        let follows = value("angle_correlation", "prediction").unwrap();
        assert!(follows > 0.8, "{}", metric("angle_correlation"));
        assert_eq!(value("angle_correlation", "mean_pose"), None);
        let speed = |source: &str| value("angular_speed", source).unwrap();
        let relative = speed("prediction") / speed("truth");
        assert!((0.5..1.5).contains(&relative) && speed("mean_pose") == 0.0, "{relative}");
        assert!(value("hellinger_angular_speed", "prediction") < value("hellinger_angular_speed", "mean_pose"));
    }
}

#[test]
fn without_channels_the_posture_of_a_dataset_is_ignored() {
    let folder = tempfile::tempdir().unwrap();
    let few = |channels: &[PostureChannel]| GanConfig { batch: 2.into(), steps: 2.into(), ..settings(channels) };
    let (plain, posed) =
        (dataset(&folder.path().join("plain")), dataset_of(&folder.path().join("posed"), with_posture));
    let trained = |dataset: &Dataset, name: &str, settings: GanConfig| {
        let out = folder.path().join(name);
        train_gan(dataset, &settings, &out, &Silent).unwrap();
        (bytes(&out), checkpoint::facts(&out.join(BEST)).unwrap().to_string(), out)
    };
    let (of_plain, facts, out) = trained(&plain, "a", few(&[]));
    assert!(!facts.contains("channels") && GestureGenerator::open(&out).is_ok());
    let (of_posed, other, _) = trained(&posed, "b", few(&[]));
    let hashes = [&plain, &posed].map(|dataset| dataset.hash().unwrap());
    assert_eq!(facts.replace(&hashes[0], &hashes[1]), other);
    let log = |files: &[(String, Vec<u8>)]| files.iter().find(|(name, _)| name == "metrics.jsonl").unwrap().1.clone();
    assert!(log(&of_plain) == log(&of_posed), "channels that are not trained affect the losses");

    // The trunk only, with positions and their bone loss; the head is not generated.
    let trunk = GanConfig { representation: MotionRepresentation::Positions, ..few(&[PostureChannel::Trunk]) };
    let (_, facts, out) = trained(&posed, "c", trunk);
    assert!(facts.contains("\"channels\":[\"trunk\"]"), "{facts}");
    let speaker = GestureGenerator::open(&out).unwrap();
    let (_, posture) = speaker.motion_and_posture(&sample("d-00000000-000000", 40, 0.3).sound, &[]).unwrap();
    let posture = posture.unwrap();
    assert!(posture.head.iter().all(|v| v.is_nan()) && posture.trunk.iter().all(|v| v.is_finite()));

    let error = train_gan(&plain, &few(&[PostureChannel::Head]), &folder.path().join("d"), &Silent).unwrap_err();
    assert!(format!("{error:#}").contains("posture = true"), "{error:#}");
}
