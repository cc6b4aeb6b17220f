//! The valid files that the fuzz tests mutate, written by the program's own writers. `cargo test --test it -- --ignored
//! fuzz::corpus` regenerates them.

use crate::fixtures::figures::swinging;
use crate::fixtures::fuzzing::harness::fixtures;
use crate::fixtures::media::foreign_keypoints as foreign;
use crate::fixtures::motion_folders;
use crate::fixtures::samples::constant_sample;
use crate::fixtures::write_dataset::write_dataset;
use crate::foreign::transcripts::FORMATS;
use ndarray::{Array1, Array2, Array3, arr1, s};
use ndarray_npy::{NpzWriter, write_npy};
use orator_base::types::skeleton::N_BONES;
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;
use orator_dataset::Split;
use orator_dataset::split::{RecordedSplit, SplitBy, SplitRecord};
use orator_formats::{authors_txt, joints_npz, npy, wav};
use orator_gesture::generate::model::{GENERATOR, SpeakerMetadata};
use orator_gesture::generate::normalisation::{N_FEATURES, Normalisation};
use orator_gesture::generate::representation::Representation;
use orator_nn::gan::generator::{Config, Generator, Preset};
use orator_nn::lifter::body::BodyLifter;
use orator_nn::lifter::hand;
use orator_nn::params::Params;
use orator_nn::weights::Contents;
use orator_onnx::Manifest;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const FPS: FrameRate = FrameRate::new(15, 1);

/// Path of a file of the corpus; creates its folder.
fn at(family: &str, name: &str) -> PathBuf {
    let path = fixtures(family).join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    path
}

fn write_text(family: &str, name: &str, text: &str) {
    fs::write(at(family, name), text).unwrap();
}

#[test]
#[ignore = "writes fixtures/fuzz"]
fn write() {
    arrays();
    motion();
    texts();
    weights();
    let samples = ["one-000000", "one-000040"].map(|key| (Split::Train, constant_sample(key, 4, 3)));
    fs::create_dir_all(fixtures("dataset")).unwrap();
    write_dataset(&fixtures("dataset"), "host", FPS, &samples).unwrap();
    let sound = Sound { rate: 16_000, samples: (0..800).map(|n| (n as f32 / 9.0).sin() / 2.0).collect() };
    wav::write(&at("media", "a.wav"), &sound).unwrap();
    let files = orator_test_support::project::files_under(&fixtures("dataset").join(".."));
    let n_bytes: u64 = files.iter().map(|(_, path)| fs::metadata(path).unwrap().len()).sum();
    assert!(n_bytes < 300_000, "{n_bytes} bytes");
}

fn arrays() {
    let motion = swinging(1, 3);
    npy::write(&at("arrays", "motion.npy"), &motion).unwrap();
    write_npy(at("arrays", "motion-flat.npy"), &Array2::<f64>::from_elem((2, 147), 0.1)).unwrap();
    let sample = foreign::sample(3, FPS);
    foreign::holistic(&at("arrays", "keypoints.npy"), &sample, foreign::HolisticOrder::NoFace);
    let positions = foreign::sample(6, FPS).body.slice(s![.., .., ..2]).as_standard_layout().to_owned();
    write_npy(at("arrays", "keypoints-coco.npy"), &positions).unwrap();
    let points = Array3::<f32>::from_elem((2, 59, 3), 0.5);
    fs::write(at("arrays", "slice.npy"), npy::write_f32(points.shape(), points.iter())).unwrap();
    let mask = Array2::from_elem((2, 49), true);
    fs::write(at("arrays", "slice-mask.npy"), npy::write_bool(mask.shape(), mask.iter())).unwrap();
    joints_npz::write(&at("arrays", "joints.npz"), &motion).unwrap();
    let before = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/before/work");
    for (stage, file) in [("pose2d", "keypoints.npz"), ("extract", "timeline.npz"), ("segment", "measures.npz")] {
        fs::copy(before.join(stage).join("host/clip-1-f39adeef").join(file), at("arrays", file)).unwrap();
    }
    let mut npz = NpzWriter::new_compressed(fs::File::create(at("arrays", "capture-ted.npz")).unwrap());
    npz.add_array("fps", &arr1(&[15i64])).unwrap();
    let joint = |(t, j, k): (usize, usize, usize)| ((t + 7 * j + 3 * k) % 11) as f64 / 20.0;
    npz.add_array("human_joints", &Array3::from_shape_fn((20, 43, 3), joint)).unwrap();
    npz.finish().unwrap();
    let mut npz = NpzWriter::new_compressed(fs::File::create(at("arrays", "capture-smplx.npz")).unwrap());
    npz.add_array("poses", &Array2::from_shape_fn((3, 165), |(t, k)| joint((t, k, 0)))).unwrap();
    npz.finish().unwrap();
    let mut npz = NpzWriter::new_compressed(fs::File::create(at("arrays", "capture-seamless.npz")).unwrap());
    for (key, n) in [("global_orient", 1), ("body_pose", 21), ("left_hand_pose", 15), ("right_hand_pose", 15)] {
        let vectors = Array3::from_shape_fn((3, n, 3), |index| joint(index) / 4.0);
        npz.add_array(format!("smplh:{key}"), &vectors).unwrap();
    }
    npz.add_array("smplh:is_valid", &arr1(&[true, true, false])).unwrap();
    npz.finish().unwrap();
    let (from, to) = (at("arrays", "motion.npy"), at("arrays", "capture-own.smplx.npz"));
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    assert!(command.arg("animate").arg(from).arg("--out").arg(to).output().unwrap().status.success());
    let mut npz = NpzWriter::new_compressed(fs::File::create(at("arrays", "capture-cmu.npz")).unwrap());
    npz.add_array("fps", &Array1::from_elem(1, 60.0)).unwrap();
    npz.add_array("walk", &Array3::from_shape_fn((4, 38, 3), |index| 900.0 * joint(index))).unwrap();
    npz.finish().unwrap();
}

fn motion() {
    let motion = swinging(1, 3);
    write_text("motion", "a.txt", &authors_txt::format(&motion));
    let (from, to) = (at("arrays", "motion.npy"), at("motion", "a.bvh"));
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    assert!(command.arg("animate").arg(from).arg("--out").arg(to).output().unwrap().status.success());
    // A comment and a name in Shift-JIS, a rounded frame time, and an incomplete last frame.
    let bvh = fs::read_to_string(at("motion", "a.bvh")).unwrap();
    let (before, after) = bvh.split_once("JOINT Spine").unwrap();
    let after = after.replace("0.06666667", "0.067");
    let after = &after.as_bytes()[..after.len() - 700];
    let parts = [b"// \x8dr\r\n".as_slice(), before.as_bytes(), b"JOINT \x83{\x81[\x83\x93", after];
    fs::write(at("motion", "a.bvh-cut-off"), parts.concat()).unwrap();
    for (name, n) in [("labels-nyu.txt", 42), ("labels-icvl.txt", 48)] {
        let line = |t: usize| (0..n).map(|k| format!("{} ", 100 + (13 * k + t) % 90)).collect::<String>();
        write_text("motion", name, &(0..3).map(|t| line(t) + "\n").collect::<String>());
    }
}

fn texts() {
    let sample = foreign::sample(2, FPS);
    foreign::openpose(&at("texts", "openpose"), &sample, foreign::OpenPoseOrder::Body25);
    let first = fs::read_dir(fixtures("texts").join("openpose")).unwrap().next().unwrap().unwrap().path();
    fs::rename(first, at("texts", "keypoints-openpose.json")).unwrap();
    fs::remove_dir_all(fixtures("texts").join("openpose")).unwrap();
    let text = fs::read_to_string(at("texts", "keypoints-openpose.json")).unwrap();
    write_text("texts", "keypoints-openpose-before-1.3.json", &text.replace("keypoints_2d", "keypoints"));
    foreign::mmpose(&at("texts", "keypoints-mmpose.json"), &sample, 17);
    foreign::alphapose(&at("texts", "keypoints-alphapose.json"), &sample, 17);
    foreign::wholebody(&at("texts", "keypoints-wholebody.json"), &sample);
    for (ending, text) in [
        ("srt", "1\r\n00:00:01,000 --> 00:00:02,000\r\n<i>so</i> well\r\n\r\n"),
        ("vtt", "WEBVTT\n\n00:01.000 --> 00:02.000 align:start\nso well\n"),
        ("tsv", "start\tend\tword\n0.5\t0.7\tso\n1.0\t1.25\twell\n"),
        ("json", r#"[{"alternatives": [{"words": [{"start_time": "0.5s", "end_time": "0.7s", "word": "so"}]}]}]"#),
        (
            "TextGrid",
            "File type = \"ooTextFile\"\nObject class = \"TextGrid\"\n\n0\n2\n<exists>\n1\n\"IntervalTier\"\n\
             \"words\"\n0\n2\n2\n0\n0.5\n\"\"\n0.5\n2\n\"so\"\n",
        ),
    ] {
        write_text("texts", &format!("words.{ending}"), text);
    }
    for format in FORMATS {
        write_text("texts", &format!("words-{}.{}", format.name, format.ending), format.text);
    }
    let speaker = "\n[[speaker]]\nname = \"host\"\nvideos = [\"*.mp4\", \"**/a.mov\"]\ntrain = [\"a.mp4\"]\n";
    write_text("texts", "pipeline.toml", &format!("{}{speaker}", orator_dataset::config::DEFAULT_FILE));
    let builtin = Manifest::builtin().unwrap();
    let models = ["body-marker", "hand-marker", "person-marker"];
    let models = models.iter().filter_map(|id| builtin.get(id).ok().cloned()).collect();
    let manifest = Manifest { models, ..Manifest::default() };
    write_text("texts", "manifest.toml", &toml::to_string(&manifest).unwrap());
    write_text("texts", "sounds.csv", "audio,out,checkpoint\na.wav,x/a,host\n\"b;c.mp3\",\"take \"\"1\"\".bvh\",\n");
    write_text("texts", "log.jsonl", "{\"step\":1,\"loss\":0.5}\n{\"step\":2,\"loss\":0.25,\"test\":{\"x\":1}}\n");
    let before = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/before/work");
    for (stage, file) in [("segment", "ledger.json"), ("extract", "media.json")] {
        let to = at("texts", &format!("stage-{file}"));
        fs::copy(before.join(stage).join("host/clip-1-f39adeef").join(file), to).unwrap();
    }
    let mut record = SplitRecord::new(orator_dataset::config::SplitUnit::Video, "by default".to_owned());
    let split = RecordedSplit { name: "a".into(), split: Some(Split::Test), by: SplitBy::Share, blocks: Vec::new() };
    record.videos.insert("00aa".into(), split);
    record.write(&at("texts", "stage-splits.json")).unwrap();
    evaluation_result();
}

/// Writes the JSON output of an evaluation of two short clips.
fn evaluation_result() {
    let dir = tempfile::tempdir().unwrap();
    motion_folders::folders(dir.path(), &[3, 3]);
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    let args = "--json evaluate --truth truth --prediction prediction";
    let output = command.current_dir(dir.path()).args(args.split(' ')).output().unwrap();
    let mut found: Value = serde_json::from_slice(&output.stdout).unwrap();
    // A few metrics suffice.
    if let Some(metrics) = found["metrics"].as_array_mut() {
        metrics.truncate(4);
    }
    write_text("texts", "result.json", &found.to_string());
}

fn weights() {
    let write = |name: &str, facts: Value, prefix: &str, params: &Params| {
        let mut contents = Contents { facts, tensors: BTreeMap::new() };
        contents.add(prefix, params.tensors().unwrap());
        contents.write(&at("weights", name)).unwrap();
    };
    let table = vec![1.0; N_FEATURES];
    let normal =
        Normalisation { mean: table.clone(), std: table, bone_lengths: vec![0.1; N_BONES], channels: Vec::new() };
    let network = Config { width: 4, ..Config::from_preset(Preset::Light, N_FEATURES) };
    let facts = SpeakerMetadata::new("host", FPS, "", network.clone(), normal, Representation::Positions);
    let mut params = Params::new(7);
    Generator::new(&mut params, &network).unwrap();
    write("speaker.safetensors", json!({ "speaker": facts }), GENERATOR, &params);
    let config = hand::Config { hidden: 4, ..hand::Config::default() };
    let mut params = Params::new(1);
    hand::HandLifter::new(&mut params, hand::NAME, &config).unwrap();
    write("lifter-hands.safetensors", json!({ "kind": "hand-lifter", "lesson": { "config": config } }), "", &params);
    let config = BodyLifter::config(4, &[3]);
    let mut params = Params::new(1);
    BodyLifter::new(&mut params, &config).unwrap();
    write("lifter-body.safetensors", json!({ "kind": "body-lifter", "lesson": { "config": config } }), "", &params);
}
