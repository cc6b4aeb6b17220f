//! `orator animate` from the command line: a file, a folder, a dataset; invalid input gives a clear error, exit code 1
//! and no output.

use crate::fixtures::animation::bvh::{Bvh, worst_mm};
use crate::fixtures::figures::{FPS, swinging};
use crate::fixtures::write_dataset::write_dataset;
use ndarray::{Array3, s};
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_HAND, R_HAND};
use orator_base::types::sound::{SAMPLE_RATE, Sound};
use orator_base::types::time::FrameRate;
use orator_dataset::sample::N_KEYPOINTS;
use orator_dataset::{Sample, Split};
use orator_formats::{authors_txt, joints_npz, npy};
use orator_media::ffmpeg::audio;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::path::Path;
use std::process::Command;

/// Exit code, JSON and standard error of `orator --json animate ...`.
pub(super) fn animate(dir: &Path, args: &str) -> (i32, Value, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    let output = command.args(["--json", "animate"]).args(args.split_whitespace()).current_dir(dir).output().unwrap();
    let json = serde_json::from_slice(&output.stdout).unwrap_or_default();
    (output.status.code().unwrap_or(-1), json, String::from_utf8_lossy(&output.stderr).into_owned())
}

pub(super) fn done(dir: &Path, args: &str) -> Value {
    let (code, json, errors) = animate(dir, args);
    assert_eq!(code, 0, "{args}: {errors}");
    json
}

#[test]
fn a_motion_is_exported_to_files_with_a_report() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let motion = swinging(1, 45);
    npy::write(&dir.join("a.npy"), &motion).unwrap();
    let facts = done(dir, "a.npy --out made/a.bvh made/b.npy --out made/b.txt --fps 30");
    assert_eq!((facts["n_frames"].as_u64(), facts["written_frames"].as_u64()), (Some(45), Some(90)));
    let report = &facts["report"];
    let jerk = |report: &Value| ["before", "after"].map(|when| report["arms"][when].as_f64().unwrap());
    let [before, after] = jerk(report);
    assert!((after / before - 1.0).abs() < 0.2, "a motion without noise: {before} -> {after}");
    let mut noisy = motion.clone();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    noisy.joints.mapv_inplace(|v| v + rng.random_range(-0.005f32..0.005));
    npy::write(&dir.join("noisy.npy"), &noisy).unwrap();
    let fixed = done(dir, "noisy.npy --out fixed.bvh --smoothing savitzky-golay");
    let [before, smoothed] = jerk(&fixed["report"]);
    assert!(smoothed < 0.7 * before, "{before} -> {smoothed}");
    let elbow = &report["clamps"][0];
    assert_eq!((elbow["kind"].as_str(), report["face_frames"].is_null()), (Some("elbow flexion"), true));
    assert!(elbow["share"].is_number() && elbow["largest_excess_degrees"].is_number());
    assert_eq!(facts["next"], "orator animate a.npy --out made/a.mp4");

    let fps = FrameRate::new(30, 1);
    let joints = npy::read(&dir.join("made/b.npy"), fps).unwrap();
    let bvh = Bvh::parse(&std::fs::read_to_string(dir.join("made/a.bvh")).unwrap());
    let worst = worst_mm(&joints, &bvh, |frame| bvh.places(frame));
    assert!(worst < 0.1, "{worst} mm");
    let text = authors_txt::read(&dir.join("made/b.txt"), fps).unwrap();
    assert!((&text.joints - &joints.joints).iter().all(|v| v.abs() < 1e-6));
    // Another format, read without processing, has the same joints.
    done(dir, "made/b.txt --input-fps 30 --out c.npy --smoothing none --no-constraints");
    let read_back = npy::read(&dir.join("c.npy"), fps).unwrap();
    assert!((&read_back.joints - &joints.joints).iter().all(|v| v.abs() < 1e-4));
    for more in [
        "--smoothing adaptive --smoothing-strength 2",
        "--shoulder-yaw removed --curl-coherence off",
        "--fps 30000/1001 --names mixamo --neutral-head",
    ] {
        done(dir, &format!("a.npy --out d.bvh {more}"));
    }
    done(dir, "a.npy --out e.fbx e.vrm e.vrma");
    // Retargeting to the skeleton of another file, with detected bones and with a bone map.
    done(dir, "a.npy --retarget made/a.bvh --write-bone-map bones.toml --out f.bvh");
    let found = std::fs::read_to_string(dir.join("bones.toml")).unwrap();
    assert!(found.contains("LeftArm = \"LeftArm\"") && found.contains("Chest = \"Chest\""), "{found}");
    done(dir, "a.npy --retarget made/a.bvh --bone-map bones.toml --out g.bvh");
    let [by_names, by_map] = ["f.bvh", "g.bvh"].map(|name| std::fs::read(dir.join(name)).unwrap());
    assert_eq!(by_names, by_map);
}

#[test]
fn incomplete_detection_of_the_body_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let printed = |motion: &Motion| {
        joints_npz::write(&dir.join("a.npz"), motion).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
        let output = command.args(["animate", "a.npz", "--out", "a.bvh"]).current_dir(dir).output().unwrap();
        assert!(output.status.success());
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
    };
    let complete = swinging(1, 40);
    assert!(!printed(&complete).contains("detected"));
    // Interpolated frames outside the mask, and frames without a number.
    let mut motion = complete;
    motion.mask.slice_mut(s![..10, ..]).fill(false);
    motion.joints.slice_mut(s![35.., R_HAND.., ..]).fill(f32::NAN);
    motion.mask.slice_mut(s![12..14, L_HAND + 1..L_HAND + 10]).fill(false);
    motion.mask.slice_mut(s![14..17, L_HAND + 1..L_HAND + 12]).fill(false);
    let text = printed(&motion);
    let expected =
        "detected, of 40 frames: arms in 30, left hand in 27, right hand in 25; other frames are interpolated or held";
    assert!(text.contains(expected), "{text}");
    let detected = &done(dir, "a.npz --out a.bvh")["report"]["detected"];
    assert_eq!(*detected, serde_json::json!({ "left_arm": 30, "right_arm": 30, "left_hand": 27, "right_hand": 25 }));
}

#[test]
fn a_film_has_the_audio_of_its_run_and_missing_audio_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let (lifted, extracted) = (dir.join("work/lift/host/talk"), dir.join("work/extract/host/talk"));
    std::fs::create_dir_all(&lifted).unwrap();
    std::fs::create_dir_all(&extracted).unwrap();
    joints_npz::write(&lifted.join("joints.npz"), &swinging(1, 15)).unwrap();
    let silent = done(dir, "work/lift/host/talk --out silent.mp4");
    assert_eq!(silent["film_has_sound"], false);
    assert!(audio::read_mono(&dir.join("silent.mp4"), SAMPLE_RATE).unwrap().is_none());
    let sound = crate::fixtures::clips::tone(SAMPLE_RATE, 2.0, 440.0);
    orator_formats::wav::write(&extracted.join("audio.wav"), &sound).unwrap();
    assert_eq!(done(dir, "work/lift/host/talk --out heard.mp4")["film_has_sound"], true);
    let audio_track = audio::read_mono(&dir.join("heard.mp4"), SAMPLE_RATE).unwrap().unwrap();
    assert!((15_000..18_000).contains(&audio_track.samples.len()), "{} samples", audio_track.samples.len());
    assert!(done(dir, "work/lift/host/talk --out a.bvh")["film_has_sound"].is_null());
}

#[test]
fn a_folder_of_motions_is_exported_to_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    std::fs::create_dir_all(dir.join("in")).unwrap();
    npy::write(&dir.join("in/a.npy"), &swinging(1, 20)).unwrap();
    std::fs::write(dir.join("in/b.txt"), authors_txt::format(&swinging(2, 20))).unwrap();
    let facts = done(dir, "in --out made --format bvh,npy");
    assert_eq!(facts["motions"].as_array().unwrap().len(), 2);
    let mut names: Vec<_> = std::fs::read_dir(dir.join("made")).unwrap().map(|f| f.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["a.bvh", "a.npy", "a.npy.json", "b.bvh", "b.npy", "b.npy.json"]);
    // An invalid file does not stop the others.
    std::fs::write(dir.join("in/c.txt"), "1 2 3\n").unwrap();
    let (code, json, errors) = animate(dir, "in --out again --format bvh");
    assert_eq!((code, json["failed"].as_u64()), (2, Some(1)));
    assert!(errors.contains("failed  c") && dir.join("again/b.bvh").exists());
}

#[test]
fn samples_of_a_dataset_are_animated_with_their_faces() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let n_frames = 30;
    // The face of a person who turns to the left and back, 400 px per metre.
    let mut pose2d = Array3::zeros((n_frames, N_KEYPOINTS, 3));
    let points =
        [[0.0, 0.015, 0.12], [0.032, -0.03, 0.085], [-0.032, -0.03, 0.085], [0.075, 0.0, 0.0], [-0.075, 0.0, 0.0]];
    for t in 0..n_frames {
        let yaw = 0.5 * (std::f64::consts::PI * t as f64 / 29.0).sin();
        for (k, [x, y, z]) in points.into_iter().chain([[0.18, 0.25, -0.1], [-0.18, 0.25, -0.1]]).enumerate() {
            let turned = if k < 5 { yaw.cos() * x + yaw.sin() * z } else { x };
            let point = [320.0 + 400.0 * turned, 200.0 + 400.0 * y, 0.9].map(|v| v as f32);
            pose2d.slice_mut(s![t, k, ..]).assign(&ndarray::arr1(&point));
        }
    }
    let sound = Sound { rate: SAMPLE_RATE, samples: vec![0.1; 32_000] };
    let sample = |n: usize| Sample {
        key: ["talk-0a1b2c3d-000000", "walk-99999999-000007"][n].to_owned(),
        motion: swinging(n as u64, n_frames),
        pose2d: pose2d.clone(),
        sound: sound.clone(),
        words: None,
        posture: None,
        interlocutor: None,
        meta: serde_json::json!({ "first_frame": 0, "n_frames": n_frames }),
    };
    let samples: Vec<(Split, Sample)> = vec![(Split::Train, sample(0)), (Split::Test, sample(1))];
    write_dataset(&dir.join("host"), "host", FPS, &samples).unwrap();

    let facts = done(dir, "host --sample walk-99999999-000007 --out a.bvh --smoothing none");
    assert_eq!(facts["report"]["face_frames"].as_u64(), Some(30));
    let bvh = Bvh::parse(&std::fs::read_to_string(dir.join("a.bvh")).unwrap());
    let head = bvh.names.iter().position(|name| name == "Head").unwrap();
    let nose = bvh.names.iter().position(|name| name == "HeadEnd").unwrap();
    assert!(head < nose);
    assert_eq!(done(dir, "host --split test --out b --format bvh")["motions"].as_array().unwrap().len(), 1);
    assert_eq!(done(dir, "host --out c --format bvh")["motions"].as_array().unwrap().len(), 2);
    for (args, expected) in [
        ("host --sample nobody --out x.bvh", "talk-0a1b2c3d-000000, walk-99999999-000007"),
        ("host --out x.bvh", "contains 2 motions"),
        ("host --split validation --out x --format bvh", "no sample in this split"),
    ] {
        let (code, _, errors) = animate(dir, args);
        assert!(code == 1 && errors.contains(expected), "{args}: {code} {errors}");
    }
}

#[test]
fn errors_name_the_cause_and_leave_no_output() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let write = |name: &str, joints: Array3<f32>| {
        npy::write(&dir.join(name), &Motion { fps: FPS, mask: Default::default(), joints }).unwrap();
    };
    let good = swinging(0, 10).joints;
    write("good.npy", good.clone());
    write("nan.npy", Array3::from_elem((10, 49, 3), f32::NAN));
    write("empty.npy", Array3::zeros((0, 49, 3)));
    write("few.npy", Array3::zeros((10, 43, 3)));
    write("millimetres.npy", &good * 1000.0);
    std::fs::write(dir.join("words.txt"), "a motion\n").unwrap();
    std::fs::write(dir.join("picture.png"), "no motion").unwrap();
    std::fs::create_dir(dir.join("nothing")).unwrap();
    for (args, expected) in [
        ("gone.npy --out x.bvh", "gone.npy does not exist"),
        ("nan.npy --out x.bvh", "all joints of all 10 frames are missing"),
        ("empty.npy --out x.bvh", "has no frames"),
        ("few.npy --out x.bvh", "[10, 43, 3], expected [frames, 49, 3]"),
        ("millimetres.npy --out x.bvh", "coordinates are metres relative to the neck"),
        ("millimetres.npy --out x.bvh", "seems to be in millimetres; multiply every coordinate by 0.001"),
        ("words.txt --out x.bvh", "line 1, column 1: `a` is not a number"),
        ("picture.png --out x.bvh", "is not a motion file: expected .npy"),
        ("nothing --out x --format bvh", "contains no motion"),
        ("good.npy --out x.mov", "unknown motion format"),
        ("good.npy --out x --format mov", "unknown motion format"),
        ("good.npy --out good.npy", "is an input"),
        ("good.npy --out x.bvh x.bvh", "listed twice"),
        ("good.npy --out nothing", "is a folder"),
        ("good.npy --out x.bvh --input-fps 0", "1 to 1000 fps"),
        ("good.npy --out x.bvh --fps 1001", "1 to 1000 fps"),
        ("good.npy --out x.bvh --fps fast", "1 to 1000 fps"),
        ("good.npy --out x.bvh --sample one", "is not a dataset"),
        ("good.npy --out x.bvh --smoothing-strength 101", "expected 0 to 100"),
        ("good.npy --out x.mp4 --audio picture.png", "picture.png"),
        ("good.npy --out x.bvh --audio good.npy", "--audio applies to .mp4"),
        ("good.npy --out x.npy --names vrm", "--names applies to .bvh"),
        ("good.npy --out x.vrm --names mixamo", "--names applies to .bvh"),
        ("good.npy --out x.bvh --retarget good.npy", "expected .bvh, .glb or .vrm"),
        ("good.npy --out x.bvh --bone-map bones.toml", "--retarget"),
        ("good.npy --out x.bvh --keypoints good.npy", "good.npy"),
    ] {
        let (code, _, errors) = animate(dir, args);
        assert!(code != 0 && errors.contains(expected), "{args}: {code} {errors}");
    }
    assert!(!dir.join("x.bvh").exists() && !dir.join("x.mp4").exists() && !dir.join("x").exists());
}
