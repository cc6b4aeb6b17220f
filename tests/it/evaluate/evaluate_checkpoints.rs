//! Checkpoints of both kinds of training in one table, on a dataset of the 49 joints and on imported captures, and
//! invalid combinations.

use crate::fixtures::animation::captures::write_capture;
use crate::fixtures::browser::Browser;
use crate::fixtures::gesture_dataset::{FPS, dataset};
use crate::fixtures::models::training::train_seq2seq;
use crate::fixtures::models::untrained::write_untrained_sequence;
use crate::fixtures::write_dataset::write_dataset;
use orator_base::motion::{bones, resample};
use orator_base::stage::progress::Silent;
use orator_base::types::skeleton::L_HAND;
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;
use orator_dataset::config::{Seq2seqConfig, SequenceNetwork};
use orator_dataset::import::find::TakeFiles;
use orator_dataset::import::take::{ImportedTake, TakeLimits, TakeOutcome};
use orator_dataset::{Dataset, Sample, Split};
use orator_formats::bvh::exponential_maps::{ExponentialMaps, JointMapping};
use orator_formats::bvh::read::Bvh;
use orator_formats::mocap::bvh;
use orator_formats::mocap::captured::MotionKind;
use orator_formats::wav;
use orator_formats::word_vectors::glove;
use orator_gesture::generate::seq2seq::architecture::Architecture;
use orator_gesture::train::seq2seq::captures::CaptureFolder;
use orator_gesture::train::seq2seq::source::TrainingSource;
use orator_media::ffmpeg::audio;
use orator_test_support::project::{ProgramAnswer, Project};
use serde_json::Value;
use std::f64::consts::TAU;
use std::path::Path;

/// Trains for a few steps.
fn train_sequence(source: TrainingSource, network: SequenceNetwork, out: &Path) {
    let schedule = Seq2seqConfig {
        steps: 4.into(),
        epoch_steps: 2.into(),
        checkpoint_every: 2,
        keep_checkpoints: 2,
        ..Default::default()
    };
    let settings = Seq2seqConfig { network, batch: 3.into(), hidden: 8, stride_frames: 5.into(), ..schedule };
    train_seq2seq(source, None, &settings, out, &Silent).unwrap();
}

fn train_gan(project: &Project, data: &str, out: &str) {
    let sets = ["gan.batch=2", "gan.epoch_steps=2", "gan.checkpoint_every=2"].map(|set| ["--set", set]).concat();
    let answer =
        project.answer(&[&["train", "gan", "--dataset", data, "--out", out, "--steps", "2"], &sets[..]].concat());
    assert_eq!(answer.code, 0, "{}", answer.errors);
}

/// Keys of the rows, and their checkpoints.
fn rows(answer: &ProgramAnswer) -> Vec<(String, String)> {
    let text = |row: &Value, key: &str| row[key].as_str().unwrap_or_default().to_owned();
    let rows = answer.json["predictors"].as_array().unwrap();
    rows.iter().map(|row| (text(row, "name"), text(row, "checkpoint"))).collect()
}

fn value(answer: &ProgramAnswer, name: &str, part: &str, key: &str) -> Option<f64> {
    let metrics = answer.json["metrics"].as_array().unwrap();
    let metric = metrics.iter().find(|metric| metric["name"] == name && metric["part"] == part);
    metric.unwrap()["values"][key]["value"].as_f64()
}

fn notes(answer: &ProgramAnswer) -> String {
    let notes = answer.json["notes"].as_array().unwrap();
    notes.iter().map(|note| note.as_str().unwrap().to_owned() + "\n").collect()
}

#[test]
fn networks_of_both_trainings_are_evaluated_in_one_table() {
    let project = Project::with_clips("several", 0, 1.0);
    let data = dataset(&project.dir().join("data"));
    train_gan(&project, "data", "gan");
    for (network, out) in [(SequenceNetwork::Contextual, "contextual"), (SequenceNetwork::Words, "words")] {
        train_sequence(TrainingSource::Dataset(&data), network, &project.dir().join(out));
    }
    let several = ["evaluate", "--dataset", "data", "--checkpoint", "gan", "contextual", "words"];
    let answer = project.answer(&[&several[..], &["--report", "page.html"]].concat());
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let of = |key: &str, name: &str| (key.to_owned(), name.to_owned());
    let expected = [
        of("prediction", "gan"),
        of("prediction_2", "seq2seq contextual"),
        of("prediction_3", "seq2seq words"),
        of("mean_pose", ""),
        of("median_pose", ""),
        of("nearest_neighbour", ""),
        of("mismatched_prediction", "gan"),
        of("mismatched_prediction_2", "seq2seq contextual"),
        of("mismatched_prediction_3", "seq2seq words"),
        of("mismatched_truth", ""),
        of("truth_halves", ""),
        of("truth", ""),
    ];
    assert_eq!(rows(&answer), expected);
    let error = |key: &str| value(&answer, "mpjpe", "all", key).unwrap();
    assert!(error("prediction_2") > 0.0 && error("prediction_2") != error("mismatched_prediction_2"));
    assert!(value(&answer, "mpjpe", "hands", "prediction_3").is_some());
    let conclusions = answer.json["conclusions"].as_array().unwrap();
    let of: Vec<&str> = conclusions.iter().map(|conclusion| conclusion["predictor"].as_str().unwrap()).collect();
    assert_eq!(of, ["prediction", "prediction_2", "prediction_3"]);
    assert_eq!(conclusions[0]["depends_on_audio"], answer.json["depends_on_audio"]);
    // The metrics of the GAN equal those of an evaluation of the GAN only.
    let single = project.answer(&["evaluate", "--dataset", "data", "--checkpoint", "gan"]);
    assert_eq!(single.json["truth"], answer.json["truth"]);
    assert!(single.json["conclusions"].is_null() && single.json["predictors"][0]["checkpoint"].is_null());
    let metrics = |answer: &ProgramAnswer| answer.json["metrics"].as_array().unwrap().clone();
    for (one, several) in metrics(&single).iter().zip(metrics(&answer)) {
        for key in ["prediction", "mismatched_prediction", "nearest_neighbour"] {
            // Intervals and the rounding of sums differ: all rows of a table share blocks, with the length required by
            // the slowest of its errors.
            let value = |metric: &Value| metric["values"][key]["value"].as_f64();
            let is_same = match (value(one), value(&several)) {
                (Some(one), Some(several)) => (one - several).abs() <= 1e-6 * (1.0 + one.abs()),
                (one, several) => one == several,
            };
            assert!(is_same, "{} {key}", one["plain_name"]);
        }
    }
    let genea = project.answer(&[&several[..], &["--convention", "genea"]].concat());
    assert_eq!(genea.code, 0, "{}", genea.errors);
    assert!(value(&genea, "jerk", "all_and_neck", "mismatched_prediction_3").is_some());
    if let Some(mut browser) = Browser::open(&project.dir().join("page.html"), [1200, 900]) {
        let count =
            |browser: &mut Browser, of: &str| browser.value(&format!("document.querySelectorAll('{of}').length"));
        assert_eq!(count(&mut browser, ".conclusion"), 6);
        assert_eq!(count(&mut browser, "#metrics thead .against"), 3);
        assert!(browser.problems.is_empty(), "{:?}", browser.problems);
    }

    // The decoder state of sequence-to-sequence networks is carried on request.
    let measure = |more: &[&str]| {
        let answer =
            project.answer(&[&["evaluate", "--dataset", "data", "--checkpoint", "gan", "words"], more].concat());
        assert_eq!(answer.code, 0, "{}", answer.errors);
        answer
    };
    let (renewed, carried) = (measure(&[]), measure(&["--carry-state"]));
    let change = |key: &str| {
        let [a, b] = [&renewed, &carried].map(|answer| value(answer, "mpjpe", "all", key).unwrap());
        (a - b).abs() / a
    };
    assert!(change("prediction") < 1e-6 && change("prediction_2") > 1e-6 && change("mismatched_prediction_2") > 1e-6);
    let carries = "seq2seq carries its decoder state across segments";
    assert!(notes(&carried).contains(carries) && !notes(&renewed).contains(carries));
    assert_eq!((&carried.json["carry_state"], &renewed.json["carry_state"]), (&true.into(), &Value::Null));

    let fails = |args: &[&str]| {
        let answer = project.answer(&[&["evaluate", "--dataset", "data", "--checkpoint"], args].concat());
        assert_eq!(answer.code, 1, "{}", answer.errors);
        answer.errors
    };
    assert!(fails(&["gan", "gan/best.safetensors"]).contains("given twice"));
    assert!(fails(&["gan", "--carry-state"]).contains("omit --carry-state"));
    glove::convert("world 1 -1\n".as_bytes(), &project.dir().join("table.safetensors")).unwrap();
    assert!(fails(&["gan", "--words", "table.safetensors"]).contains("omit --words"));
    assert!(
        fails(&["gan", "words", "--words", "table.safetensors"])
            .contains("the model of host was trained without a table of word vectors")
    );
    assert!(fails(&["gan", "nowhere"]).contains("nowhere does not exist"));
    assert!(fails(&["data"]).contains("no checkpoint in data"));
    let lifter = concat!(env!("CARGO_MANIFEST_DIR"), "/models/body_lifter.safetensors");
    assert!(fails(&["gan", lifter]).contains("body_lifter.safetensors is not a checkpoint of `orator train gan` or"));
    std::fs::write(project.dir().join("other.safetensors"), "x").unwrap();
    assert!(fails(&["gan", "other.safetensors"]).contains("other.safetensors"));
}

/// A capture as a sample of a dataset at `FPS`.
fn imported(dir: &Path, name: &str) -> Sample {
    let file = |ending: &str| Some(dir.join(format!("{name}.{ending}"))).filter(|path| path.exists());
    let [motion, sound, transcript] = ["bvh", "wav", "tsv"].map(file);
    let files = TakeFiles {
        kind: MotionKind::Bvh,
        motion: motion.unwrap(),
        sound,
        transcripts: transcript.into_iter().collect(),
        genea: None,
        origin: None,
    };
    let limits = TakeLimits { fps: FPS, min_frames: 30, max_difference_secs: 0.5, no_sound: false, units: None };
    match ImportedTake::read(&files, &limits, "host").unwrap().outcome {
        TakeOutcome::Accepted(accepted) => accepted.sample,
        TakeOutcome::Rejected(rejection) => panic!("{rejection:?}"),
    }
}

#[test]
fn captured_skeletons_and_the_gan_are_evaluated_on_common_joints() {
    let project = Project::with_clips("captured", 0, 1.0);
    let (captures, at_48_khz) = (project.dir().join("captures"), project.dir().join("loud"));
    for (name, secs, phase) in [("a", 9.0, 0.0), ("b", 9.0, 2.0), ("c", 14.0, 4.0)] {
        write_capture(&captures, name, secs, phase, true);
        write_capture(&at_48_khz, name, secs, phase, false);
        let sound = audio::read_mono(&captures.join(format!("{name}.wav")), 48_000).unwrap().unwrap();
        wav::write(&at_48_khz.join(format!("{name}.wav")), &sound).unwrap();
    }
    let take = |split, name: &str| (split, imported(&captures, name));
    let samples = [take(Split::Train, "a"), take(Split::Train, "b"), take(Split::Validation, "c")];
    assert!(samples.iter().all(|(_, sample)| sample.words.as_ref().is_some_and(|words| !words.is_empty())));
    let data = project.dir().join("data");
    write_dataset(&data, "host", FPS, &samples).unwrap();
    for (dir, network, out) in
        [(&captures, SequenceNetwork::Words, "spoken"), (&at_48_khz, SequenceNetwork::Contextual, "heard")]
    {
        let captures = CaptureFolder::open(dir, &["c".to_owned()], JointMapping::default()).unwrap();
        train_sequence(TrainingSource::Captures(&captures), network, &project.dir().join(out));
    }
    train_gan(&project, "data", "gan");
    let measure = |args: &[&str]| {
        let answer = project.answer(&[&["evaluate", "--dataset", "data", "--checkpoint"], args].concat());
        assert_eq!(answer.code, 0, "{}", answer.errors);
        answer
    };
    let answer = measure(&["gan", "spoken", "heard"]);
    let text = notes(&answer);
    assert!(
        text.contains("8 joints of 48; left out: 40 finger joints") && text.contains("100.0 % of the frames"),
        "{text}"
    );
    assert!(text.contains("seq2seq words was trained on the captures captures"), "{text}");
    assert!(text.contains("the motion of seq2seq words was resampled from 20 fps to 15 fps"), "{text}");
    assert!(text.contains("seq2seq contextual was trained on audio at 48000 Hz"), "{text}");
    assert!(!text.contains("has none"), "{text}");
    let body = |name: &str, row: &str| value(&answer, name, "body", row);
    for row in
        ["prediction", "prediction_2", "prediction_3", "mean_pose", "nearest_neighbour", "mismatched_prediction_2"]
    {
        assert!(body("mpjpe", row).unwrap() > 0.0, "{row}");
        assert_eq!(value(&answer, "mpjpe", "hands", row), None, "{row}");
        assert!(body("frechet_pose", row).is_some());
    }
    // Networks after a few steps are near the mean of their captures, in the axes of the import.
    for row in ["prediction_2", "prediction_3"] {
        let [own, mean] = [row, "mean_pose"].map(|row| body("mpjpe", row).unwrap());
        assert!(own < 1.5 * mean, "{row}: {own}, mean pose {mean}");
    }
    assert_ne!(body("mpjpe", "prediction_2"), body("mpjpe", "mismatched_prediction_2"));
    // Metrics of complete poses cover the body part only.
    let genea = measure(&["spoken", "--convention", "genea", "--report", "page.html"]);
    for name in ["hellinger_speed", "cca"] {
        assert!(value(&genea, name, "body", "mismatched_prediction").is_some(), "{name}");
    }
    assert!(rows(&genea).iter().all(|(_, checkpoint)| checkpoint.is_empty()));

    // Vectors of words that are not in the vocabulary.
    write_untrained_sequence(&project.dir().join("hello.safetensors"), Architecture::Words, true, &["hello"]);
    glove::convert("world 1 -1 0.5 2\n".as_bytes(), &project.dir().join("table.safetensors")).unwrap();
    let (without, with) =
        (measure(&["hello.safetensors"]), measure(&["hello.safetensors", "--words", "table.safetensors"]));
    let error = |answer: &ProgramAnswer| value(answer, "mpjpe", "body", "prediction").unwrap();
    assert!((error(&without) - error(&with)).abs() > 1e-6 * error(&with));
    let n = samples[2].1.words.as_ref().map_or(0, Vec::len);
    let note = format!(
        "{} of {n} words of this split are in the vocabulary of seq2seq, {} of the others in the table of word vectors",
        n.div_ceil(2),
        n / 2
    );
    assert!(notes(&with).contains(&note) && !notes(&without).contains("table of word vectors"), "{}", notes(&with));
    assert_eq!((&with.json["words"], &without.json["words"]), (&"table.safetensors".into(), &Value::Null));

    // A dataset without words.
    let silent: Vec<(Split, Sample)> =
        samples.into_iter().map(|(split, sample)| (split, Sample { words: None, ..sample })).collect();
    write_dataset(&project.dir().join("silent"), "host", FPS, &silent).unwrap();
    let answer = project.answer(&["evaluate", "--dataset", "silent", "--checkpoint", "spoken"]);
    assert!(notes(&answer).contains("seq2seq uses words, and this split has none"), "{}", notes(&answer));
}

#[test]
fn a_captured_motion_round_trips_as_it_is_imported() {
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path(), "a", 9.0, 1.0, false);
    let expected = imported(folder.path(), "a").motion;
    let read = || Bvh::read(&folder.path().join("a.bvh")).unwrap();
    let maps = ExponentialMaps::of([Ok(("a".to_owned(), read()))], &JointMapping::default()).unwrap();
    let text = maps.to_bvh(maps.features(&read()).unwrap().view());
    let mut resampled = resample::at_rate(&bvh::from_text(&text).unwrap().motion, FPS);
    bones::with_lengths(&mut resampled, &bones::measure(&expected));
    // Metres, except at the ends, where the two resamplings have different neighbours.
    let mut worst = 0.0f32;
    for t in 10..resampled.n_frames() - 10 {
        for joint in 0..=L_HAND {
            let difference = |k: usize| (resampled.joints[[t, joint, k]] - expected.joints[[t, joint, k]]).powi(2);
            worst = worst.max((0..3).map(difference).sum::<f32>().sqrt());
        }
    }
    assert!(resampled.n_frames() + 2 >= expected.n_frames() && worst < 0.01, "{worst} m");
}

#[test]
fn a_dataset_at_another_rate_than_the_speaker_is_rejected() {
    let project = Project::with_clips("rates", 0, 1.0);
    let data = dataset(&project.dir().join("data"));
    train_sequence(TrainingSource::Dataset(&data), SequenceNetwork::Words, &project.dir().join("words"));
    let fps = FrameRate::new(30, 1);
    let again = |split: Split| {
        let mut sample = data.read(&data.samples(split)[0]).unwrap();
        sample.motion.fps = fps;
        sample.sound.samples.truncate(sample.sound.samples.len() / 2);
        (split, sample)
    };
    write_dataset(&project.dir().join("fast"), "host", fps, &[again(Split::Train), again(Split::Validation)]).unwrap();
    assert_eq!(Dataset::open(project.dir().join("fast")).unwrap().info().fps, fps);
    let answer = project.answer(&["evaluate", "--dataset", "fast", "--checkpoint", "words"]);
    assert!(answer.code == 1 && answer.errors.contains("fast has 30 fps, the checkpoint 15 fps"), "{}", answer.errors);
}

#[test]
fn resampled_audio_has_the_same_waveform() {
    let tone = |rate: u32| {
        let sample = |i: u32| (0.4 * (TAU * 440.0 * f64::from(i) / f64::from(rate)).sin()) as f32;
        Sound { rate, samples: (0..rate).map(sample).collect() }
    };
    for (from, to) in [(16_000, 48_000), (48_000, 16_000), (16_000, 44_100), (16_000, 16_000)] {
        let resampled = audio::at_rate(&tone(from), to).unwrap();
        let expected = tone(to);
        assert_eq!((resampled.rate, resampled.samples.len()), (to, expected.samples.len()));
        let middle = to as usize / 10..to as usize * 9 / 10;
        let difference = middle.map(|i| (resampled.samples[i] - expected.samples[i]).abs()).fold(0.0, f32::max);
        assert!(difference < 1e-3, "{from} to {to}: {difference}");
    }
}
