//! Files of an earlier version (`fixtures/before`) remain readable: a dataset, a work folder and a GAN checkpoint, of
//! which only the header is stored; a formula generates its weights.

use crate::fixtures::models::untrained::generate;
use orator_dataset::verify::verify::verify;
use orator_dataset::{Dataset, Split};
use orator_test_support::project::{Project, files_under};

use candle_core::Tensor;
use orator_base::stage::fingerprint::hash_file;
use orator_base::stage::progress::Silent;
use orator_base::stage::{Stage, Unit};
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;
use orator_dataset::config::{LiftConfig, SegmentConfig};
use orator_formats::{checkpoint, npy, wav};
use orator_pipeline::lift::LiftStage;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn earlier(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/before").join(name)
}

#[test]
fn a_dataset_verifies_and_reads() {
    let folder = earlier("work/dataset/host");
    let found = verify(&folder, true, &Silent).unwrap();
    assert!(found.problems.is_empty(), "{:?}", found.problems);
    let dataset = Dataset::open(&folder).unwrap();
    assert_eq!((dataset.info().speaker.as_str(), dataset.info().splits["test"].frames), ("host", 5));
    for (split, sum) in [(Split::Train, TRAIN_SUM), (Split::Test, TEST_SUM)] {
        let samples = dataset.samples(split);
        assert_eq!(samples.len(), 1, "{split:?}");
        let sample = dataset.read(&samples[0]).unwrap();
        assert_eq!((sample.n_frames(), sample.motion.fps), (5, FrameRate::new(5, 1)));
        assert_eq!((sample.sound.rate, sample.sound.samples.len()), (16_000, 16_000));
        let found: f64 = sample.motion.joints.iter().map(|v| f64::from(*v)).sum();
        assert!((found - sum).abs() < 1e-9, "{split:?}: {found}");
    }
}

/// Sums of all coordinates of the train and of the test sample.
const TRAIN_SUM: f64 = 0.869_040_330_871_939_7;
const TEST_SUM: f64 = 23.001_238_243_654_37;

/// A project with the earlier work folder and configuration, and newly rendered clips.
fn project() -> Project {
    let project = Project::with_clips("before", 2, 1.0);
    for (name, path) in files_under(&earlier("work")) {
        let to = project.work().join(name);
        fs::create_dir_all(to.parent().unwrap()).unwrap();
        fs::copy(path, to).unwrap();
    }
    fs::copy(earlier("pipeline.toml"), project.dir().join("pipeline.toml")).unwrap();
    project
}

#[test]
fn status_reads_a_work_folder() {
    let project = project();
    let status = project.answer(&["status", "--why"]);
    assert_eq!(status.code, 0, "{}", status.errors);
    let units = status.json["units"].as_array().unwrap();
    let state = |unit: &str, stage: &str| {
        let is_fact = |fact: &&Value| fact["unit"].as_str().unwrap().starts_with(unit) && fact["stage"] == stage;
        let fact = units.iter().find(is_fact).unwrap_or_else(|| panic!("{unit} {stage}: {}", status.json));
        (fact["state"].as_str().unwrap().to_owned(), fact["reason"].as_str().unwrap_or_default().to_owned())
    };
    // The clips are newly rendered: their bytes may differ from the earlier ones, so that later stages wait for them.
    for (unit, stage) in
        [("host/clip-1", "extract"), ("host/clip-1", "lift"), ("host/clip-2", "extract"), ("host", "dataset")]
    {
        let (value, reason) = state(unit, stage);
        assert!(["fresh", "stale", "waits", "-"].contains(&value.as_str()), "{unit} {stage}: {value}: {reason}");
        eprintln!("{unit} {stage}: {value}: {reason}");
    }
}

#[test]
fn status_names_results_of_an_older_lifter_and_the_commands_that_rebuild_them() {
    let project = project();
    let stale = || {
        let results = project.answer(&["status"]).json["stale"].clone();
        let work = format!("{}/", project.work().display());
        let text = |result: &Value, key: &str| result[key].as_str().unwrap().replace(&work, "work/");
        let line = |result: &Value| ["name", "reason", "command"].map(|key| text(result, key));
        results.as_array().into_iter().flatten().map(line).collect::<Vec<_>>()
    };
    let dataset = ["dataset host", "lifted by an older lifter", "orator run"].map(str::to_owned);
    assert_eq!(stale(), std::slice::from_ref(&dataset));
    let models = project.work().join("gan/host");
    fs::create_dir_all(&models).unwrap();
    let write_model = |dataset: &str| {
        let facts = json!({ "speaker": { "name": "host", "dataset": dataset } });
        let weights: [(String, Tensor); 0] = [];
        fs::write(models.join("best.safetensors"), checkpoint::to_bytes(&facts, weights).unwrap()).unwrap();
    };
    let command = "orator train gan --speaker host --out work/gan/host-new";
    let model = |reason: &str| ["model gan/host", reason, command].map(str::to_owned);
    write_model(&hash_file(&project.work().join("dataset/host/checksums.b3")).unwrap());
    assert_eq!(stale(), [dataset.clone(), model("trained on a dataset of an older lifter")]);
    let output = Command::new(env!("CARGO_BIN_EXE_orator")).arg("status").current_dir(project.dir()).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(text.contains("dataset host: lifted by an older lifter: orator run\n"), "{text}");
    let line = "model gan/host: trained on a dataset of an older lifter: orator train gan --speaker host --out ";
    assert!(text.contains(line), "{text}");
    write_model("another");
    assert_eq!(stale(), [dataset, model("trained on another version of its dataset")]);
    write_model("");
    assert_eq!(stale().len(), 1, "the dataset of the model is unknown");

    // Lifted by the present program, dataset and model are not listed.
    let path = project.work().join("lift/host/clip-1-f39adeef.record.json");
    let mut record: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    let stage = LiftStage::new(&LiftConfig::default(), &SegmentConfig::default(), &project.work()).unwrap();
    let unit = Unit { speaker: "host".into(), video: "clip-1-f39adeef".into(), source: PathBuf::new() };
    record["fingerprint"]["version"] = json!(stage.version());
    record["fingerprint"]["settings"] = stage.settings(&unit);
    fs::write(&path, record.to_string()).unwrap();
    write_model(&hash_file(&project.work().join("dataset/host/checksums.b3")).unwrap());
    assert_eq!(stale(), Vec::<[String; 3]>::new());
    record["fingerprint"]["settings"]["lift"]["hand_weights"] = json!("file");
    fs::write(&path, record.to_string()).unwrap();
    assert_eq!(stale().len(), 2);
    // A video that fails is not in the dataset.
    fs::write(project.video("clip-1.mp4"), "no video").unwrap();
    assert_eq!(project.run(&["--only", "extract"]).code, 2);
    assert_eq!(stale(), Vec::<[String; 3]>::new());
}

#[test]
fn forget_removes_files_with_former_names() {
    let project = project();
    let measures = |files: &[(String, PathBuf)]| {
        files.iter().any(|(name, _)| name.ends_with("lift/host/clip-1-f39adeef/measures.npz"))
    };
    assert!(measures(&files_under(&project.work())));
    let read_shards = |project: &Project| -> BTreeMap<String, Vec<u8>> {
        let files = files_under(&project.work()).into_iter();
        files.filter(|(name, _)| name.ends_with(".tar")).map(|(name, path)| (name, fs::read(path).unwrap())).collect()
    };
    let shards = read_shards(&project);
    let answer = project.answer(&["forget", "--video", "clip-1.mp4"]);
    assert_eq!(answer.code, 0, "{} {}", answer.json, answer.errors);
    assert!(answer.json["found"].as_array().unwrap().is_empty(), "{}", answer.json);
    let names: Vec<String> = files_under(&project.work()).into_iter().map(|(name, _)| name).collect();
    assert!(!names.iter().any(|name| name.contains("clip-1")), "{names:?}");
    let remaining = read_shards(&project);
    assert_eq!(remaining.len(), 1, "{names:?}");
    assert!(remaining.iter().all(|(name, bytes)| shards[name] == *bytes));
    let found = verify(&project.work().join("dataset/host"), true, &Silent).unwrap();
    assert!(found.problems.is_empty(), "{:?}", found.problems);
}

/// Element `index` of the tensor `name`: 24 bits of a hash (FNV-1a of the name, then SplitMix64) scaled to 0..1.
fn hashed(name: &str, index: u64) -> f32 {
    let seed = name
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    let mut z = seed.wrapping_add(index).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 40) as f32 / 16_777_216.0
}

/// Values of a tensor: weights scaled by the number of inputs, norm parameters near one.
fn filled(name: &str, shape: &[u64]) -> Vec<f32> {
    let fan_in: u64 = shape.iter().skip(1).product();
    let value = |index: u64| {
        let (share, about_zero) = (hashed(name, index), hashed(name, index) - 0.5);
        match name {
            _ if name.ends_with(".second") => share,
            _ if name.ends_with("running_var") => 1.0 + about_zero * 0.5,
            _ if name.ends_with("norm.weight") => 1.0 + about_zero * 0.25,
            _ if shape.len() <= 1 => about_zero * 0.125,
            _ => about_zero * (4.0 / f32::from(1_u16 << (fan_in.ilog2() / 2))),
        }
    };
    (0..shape.iter().product()).map(value).collect()
}

/// Writes the stored header and the generated weights as a safetensors file.
fn write_checkpoint(path: &Path) {
    let stored: Value = serde_json::from_slice(&fs::read(earlier("checkpoint.json")).unwrap()).unwrap();
    let mut header = json!({ "__metadata__": stored["metadata"] });
    let mut data: Vec<u8> = Vec::new();
    for (name, shape) in stored["tensors"].as_object().unwrap() {
        let shape: Vec<u64> = serde_json::from_value(shape.clone()).unwrap();
        let first = data.len();
        data.extend(filled(name, &shape).into_iter().flat_map(f32::to_le_bytes));
        header[name] = json!({ "dtype": "F32", "shape": shape, "data_offsets": [first, data.len()] });
    }
    let mut header = header.to_string().into_bytes();
    header.resize(header.len().next_multiple_of(8), b' ');
    fs::write(path, [&(header.len() as u64).to_le_bytes()[..], &header, &data].concat()).unwrap();
}

#[test]
fn a_checkpoint_generates_its_original_motion() {
    let folder = tempfile::tempdir().unwrap();
    write_checkpoint(&folder.path().join("host.safetensors"));
    let samples = (0..16_000_i32).map(|i| (((i64::from(i).pow(2) * 7) >> 6) % 20_001 - 10_000) as f32 / 32_768.0);
    let sound = Sound { rate: 16_000, samples: samples.collect() };
    wav::write(&folder.path().join("speech.wav"), &sound).unwrap();
    let output = generate(folder.path(), "--checkpoint host.safetensors --audio speech.wav --out motion.npy");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let fps = FrameRate::new(15, 1);
    let [expected, generated] =
        [earlier("motion.npy"), folder.path().join("motion.npy")].map(|file| npy::read(&file, fps).unwrap());
    assert_eq!(expected.joints.dim(), generated.joints.dim());
    let difference = expected.joints.iter().zip(&generated.joints).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    eprintln!("difference: {difference:e} m at most");
    // Convolutions are computed by another algorithm since.
    assert!(difference <= 5e-6, "{difference:e} m");
}
