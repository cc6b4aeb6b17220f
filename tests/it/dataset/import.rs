//! `orator import`: datasets from captured motion and from other datasets, and takes that cannot be imported.

use orator_base::motion::bones;
use orator_base::motion::resample;
use orator_base::stage::progress::Silent;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_HAND, R_HAND};
use orator_base::types::sound::Sound;
use orator_base::types::time::FrameRate;
use orator_dataset::import::take::TakeLimits;
use orator_dataset::import::write::ImportPlan;
use orator_dataset::import::{Imported, import, shards};
use orator_dataset::info::About;
use orator_dataset::verify::verify::{read_ledgers, verify};
use orator_dataset::{Dataset, Sample};
use orator_formats::mocap::captured;
use orator_formats::mocap::captured::CapturedMotion;
use orator_formats::mocap::captured::MotionKind;
use orator_test_support::project::files_under;
use orator_test_support::skip::real_data;
use rand::{Rng, SeedableRng};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

const FPS: FrameRate = FrameRate::new(15, 1);

/// A BVH take of `n_frames` at 30 fps: the reference's nine frames back and forth.
pub(crate) fn bvh(n_frames: usize) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/reference/bvh_take.bvh");
    let text = fs::read_to_string(path).unwrap();
    let (head, frames) = text.split_once("Frames: 9\nFrame Time: 0.0333333\n").unwrap();
    let frames: Vec<&str> = frames.lines().collect();
    let swing = |t: usize| frames[if t % 16 < 8 { t % 8 } else { 8 - t % 8 }];
    let frames: String = (0..n_frames).map(|t| format!("{}\n", swing(t))).collect();
    format!("{head}Frames: {n_frames}\nFrame Time: 0.0333333\n{frames}")
}

/// Writes seeded noise.
pub(crate) fn wav(path: &Path, secs: f64, seed: u64) {
    let mut noise = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let samples = (0..(secs * 22_050.0) as usize).map(|_| noise.random_range(-0.5f32..0.5)).collect();
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    orator_formats::wav::write(path, &Sound { rate: 22_050, samples }).unwrap();
}

pub(crate) fn write(path: PathBuf, text: &str) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, text).unwrap();
}

pub(crate) fn plan(sources: &[&Path]) -> ImportPlan {
    ImportPlan {
        sources: sources.iter().map(|path| path.to_path_buf()).collect(),
        kind: None,
        speaker_id: None,
        about: About::new("host", FPS),
        limits: TakeLimits { fps: FPS, min_frames: 64, max_difference_secs: 0.5, no_sound: false, units: None },
        dataset: orator_dataset::config::DatasetConfig { validation: 0.0, test: 0.0, ..Default::default() },
    }
}

/// Imports into the new folder `out`, which must then be a valid dataset.
fn imported(sources: &[&Path], out: &Path) -> Imported {
    fs::create_dir_all(out).unwrap();
    let imported = import(&plan(sources), out, &Silent).unwrap();
    assert_eq!(verify(out, true, &Silent).unwrap().problems, []);
    imported
}

/// Samples in the shards of a dataset by key, with their JSON.
pub(crate) fn samples(dir: &Path) -> BTreeMap<String, (Sample, Vec<u8>)> {
    let tars: Vec<PathBuf> = files_under(dir).into_iter().map(|(_, path)| path).filter(|path| is_tar(path)).collect();
    let loose = shards::open(&tars);
    let all = loose.videos.into_iter().flat_map(|video| video.samples);
    all.map(|sample| (sample.key.clone(), sample.read().unwrap())).collect()
}

fn is_tar(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "tar")
}

/// Expected motion of a take: the joints of the source at 15 fps, with its bone lengths in every frame.
fn expected(captured: &CapturedMotion, n_frames: usize) -> Motion {
    let lengths = bones::measure(&captured.motion);
    let mut motion = resample::at_rate(&captured.motion, FPS);
    motion.joints = motion.joints.slice(ndarray::s![..n_frames, .., ..]).to_owned();
    motion.mask = motion.mask.slice(ndarray::s![..n_frames, ..]).to_owned();
    bones::with_lengths(&mut motion, &lengths);
    motion
}

fn max_difference(a: &Motion, b: &Motion) -> f32 {
    assert_eq!((a.joints.shape(), &a.mask), (b.joints.shape(), &b.mask));
    let differences =
        a.joints.iter().zip(&b.joints).map(|(a, b)| if a.is_nan() && b.is_nan() { 0.0 } else { (a - b).abs() });
    differences.fold(0.0, f32::max)
}

#[test]
fn bvh_files_with_audio_become_a_dataset() {
    let dir = tempfile::tempdir().unwrap();
    let source = dir.path().join("trn");
    let file = |name: &str| source.join(name);
    write(file("bvh/talk.bvh"), &bvh(301));
    wav(&file("wav/talk.wav"), 9.7, 1);
    write(file("tsv/talk.tsv"), "0.50\t0.75\tso\n9.9\t10.0\tlate\n");
    write(file("bvh/short.bvh"), &bvh(100));
    wav(&file("wav/short.wav"), 3.333, 2);
    write(file("bvh/silent.bvh"), &bvh(200));
    write(file("bvh/apart.bvh"), &bvh(200));
    wav(&file("wav/apart.wav"), 8.0, 3);
    write(file("bvh/broken.bvh"), &bvh(200)[..9000]);
    let out = dir.path().join("out");
    let answer = imported(&[&source], &out);
    let outcomes: BTreeMap<&str, (&str, &str)> = answer
        .lines
        .iter()
        .map(|line| {
            (Path::new(&line.file).file_stem().unwrap().to_str().unwrap(), (line.outcome, line.reason.as_str()))
        })
        .collect();
    let all = [
        ("apart", ("refused", "out of step")),
        ("broken", ("failed", "error")),
        ("short", ("refused", "too short")),
        ("silent", ("refused", "no sound")),
        ("talk", ("kept", "")),
    ];
    assert_eq!(outcomes, all.into());
    let message = |stem: &str| answer.lines.iter().find(|line| line.file.contains(stem)).unwrap().message.clone();
    assert!(message("broken").contains("broken.bvh"), "{}", message("broken"));
    assert!(message("apart").contains("1.333 s apart"), "{}", message("apart"));
    for ledger in read_ledgers(&out).unwrap().iter().filter(|ledger| ledger.failure.is_none()) {
        assert!(ledger.ledger.is_complete(), "{ledger:?}");
    }

    let samples = samples(&out);
    let (sample, _) = samples.values().next().unwrap();
    assert_eq!((samples.len(), sample.n_frames()), (1, 145), "9.7 s of audio");
    let captured = captured::read(MotionKind::Bvh, &file("bvh/talk.bvh")).unwrap();
    assert!(max_difference(&sample.motion, &expected(&captured, 145)) < 1e-6);
    assert_eq!(sample.sound.samples.len(), 154_667);
    let facts = &sample.meta["imported"];
    assert_eq!((facts["motion"].as_str(), facts["sound"].as_str()), (Some("talk.bvh"), Some("talk.wav")));
    assert!((facts["sound_secs"].as_f64().unwrap() - 9.7).abs() < 1e-3);
    // 301 frames end at 10.0 s, where frame 150 of the dataset begins.
    assert!((facts["motion_secs"].as_f64().unwrap() - 151.0 / 15.0).abs() < 1e-9);
    assert_eq!((sample.meta["text"].as_str(), sample.meta["words"][0]["start_secs"].as_f64()), (Some("so"), Some(0.5)));
    let dataset = Dataset::open(&out).unwrap();
    assert!(dataset.info().notes.iter().any(|note| note.contains("faces the camera")));
    // The same sources give the same bytes.
    let again = dir.path().join("again");
    imported(&[&source], &again);
    let bytes = |dir: &Path| files_under(dir).into_iter().map(|(name, path)| (name, fs::read(path).unwrap())).collect();
    let (first, second): (Vec<_>, Vec<(String, Vec<u8>)>) = (bytes(&out), bytes(&again));
    assert!(first == second);
}

#[test]
fn names_of_recorders_and_stereo_of_opposite_phase_are_imported() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join("in").join(name);
    write(at("TAKE_4.BVH"), &bvh(200));
    write(at("TAKE_4.TXT"), "so it goes");
    // One name is composed, the other decomposed.
    write(at("gru\u{308}n.bvh"), &bvh(220));
    wav(&at("gr\u{fc}n.Wav"), 7.333, 4);
    write(at("cover.jpg"), "no motion");
    let spec = hound::WavSpec {
        channels: 2,
        sample_rate: 48_000,
        bits_per_sample: 16,
        sample_format: hound::SampleFormat::Int,
    };
    let mut stereo = hound::WavWriter::create(at("TAKE_4.WAV"), spec).unwrap();
    for n in 0..320_000 {
        let left = (12_000.0 * (f64::from(n) * 0.02).sin()) as i16;
        [left, -left].into_iter().for_each(|value| stereo.write_sample(value).unwrap());
    }
    stereo.finalize().unwrap();
    let out = dir.path().join("out");
    let answer = imported(&[&at("")], &out);
    assert!(answer.lines.iter().all(|line| line.outcome == "kept") && answer.lines.len() == 2, "{:?}", answer.lines);
    let message = &answer.lines.iter().find(|line| line.file.contains("TAKE_4")).unwrap().message;
    assert!(message.contains("stereo channels of opposite phase"), "{message}");
    assert!(answer.notes.iter().any(|note| note.ends_with("of the same name: cover.jpg")), "{:?}", answer.notes);
    let samples = samples(&out);
    let (sample, _) = samples.values().find(|(sample, _)| sample.meta["text"] == "so it goes").unwrap();
    assert!(sample.sound.samples.iter().any(|sample| *sample > 0.3));
}

#[test]
fn datasets_are_merged_exactly_and_repacked_shards_are_imported() {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name);
    for (name, n_frames, seed) in [("a", 160, 1), ("b", 200, 2)] {
        write(path(&format!("{name}/{name}.bvh")), &bvh(n_frames));
        wav(&path(&format!("{name}/{name}.wav")), n_frames as f64 / 30.0, seed);
        imported(&[&path(name)], &path(&format!("dataset-{name}")));
    }
    let both = [path("dataset-a"), path("dataset-b")];
    let merged = imported(&[&both[0], &both[1]], &path("merged"));
    assert_eq!((merged.lines.len(), merged.info.videos.len()), (2, 2));
    for from in &both {
        for (name, file) in files_under(from).into_iter().filter(|(name, _)| name.contains("tar") || name.contains('/'))
        {
            assert!(fs::read(file).unwrap() == fs::read(path("merged").join(&name)).unwrap(), "{name}");
        }
    }

    // Repacked shards: another order, other member names, extra members.
    fs::create_dir(path("loose")).unwrap();
    let mut tar = tar::Builder::new(fs::File::create(path("loose/train-000007.tar")).unwrap());
    let mut members: Vec<(String, Vec<u8>)> = Vec::new();
    for (key, (sample, json)) in samples(&path("merged")) {
        let endings = orator_dataset::sample::EXTENSIONS.iter();
        members.extend(endings.zip(sample.members().unwrap()).map(|(e, bytes)| (format!("./{key}.{e}"), bytes)));
        members.iter_mut().rev().find(|(name, _)| name.ends_with("json")).unwrap().1 = json;
        members.push((format!("{key}.txt"), b"a note of theirs".to_vec()));
    }
    members.reverse();
    for (name, bytes) in &members {
        let mut header = tar::Header::new_gnu();
        header.set_size(bytes.len() as u64);
        header.set_mode(0o600);
        tar.append_data(&mut header, name, bytes.as_slice()).unwrap();
    }
    tar.finish().unwrap();
    let repacked = imported(&[&path("loose")], &path("back"));
    assert!(repacked.notes.iter().any(|note| note.contains("skipped 2 .txt files")), "{:?}", repacked.notes);
    let (before, after) = (samples(&path("merged")), samples(&path("back")));
    assert_eq!(before.keys().collect::<Vec<_>>(), after.keys().collect::<Vec<_>>());
    for (key, (sample, json)) in &before {
        let (again, json_again) = &after[key];
        assert!(sample.members().unwrap()[1..] == again.members().unwrap()[1..] && json == json_again, "{key}");
    }

    // A sample without one of its members fails, the other is imported; another frame rate is an error.
    let mut tar = tar::Builder::new(fs::File::create(path("loose/train-000007.tar")).unwrap());
    for (name, bytes) in members.iter().filter(|(name, _)| !(name.contains("/a-") && name.ends_with("wav"))) {
        let mut header = tar::Header::new_gnu();
        header.set_size(bytes.len() as u64);
        tar.append_data(&mut header, name, bytes.as_slice()).unwrap();
    }
    tar.finish().unwrap();
    let partial = imported(&[&path("loose")], &path("half"));
    let failed: Vec<_> = partial.lines.iter().filter(|line| line.outcome == "failed").collect();
    assert!(failed.len() == 1 && failed[0].message.contains("has no a-"), "{failed:?}");
    let mut other_rate = plan(&[&both[0]]);
    (other_rate.limits.fps, other_rate.about.fps) = (FrameRate::new(30, 1), FrameRate::new(30, 1));
    fs::create_dir(path("none")).unwrap();
    let text = format!("{:#}", import(&other_rate, &path("none"), &Silent).unwrap_err());
    assert!(text.contains("15 fps") && text.contains("30 fps"), "{text}");
}

#[test]
fn a_duplicate_take_is_imported_once() {
    let dir = tempfile::tempdir().unwrap();
    for folder in ["one", "two"] {
        write(dir.path().join(folder).join("a.bvh"), &bvh(160));
        wav(&dir.path().join(folder).join("a.wav"), 5.3, 1);
    }
    let answer = imported(&[dir.path()], &dir.path().join("out"));
    let outcomes: Vec<(&str, &str)> = answer.lines.iter().map(|line| (line.outcome, line.reason.as_str())).collect();
    assert_eq!(outcomes, [("kept", ""), ("refused", "duplicate")]);
}

#[test]
fn the_authors_clips_and_ted_become_datasets() {
    let Some(data) = real_data("data") else { return };
    let dir = tempfile::tempdir().unwrap();
    let clips = imported(&[&data.join("released_clips")], &dir.path().join("clips"));
    let count = |imported: &Imported, reason: &str| imported.lines.iter().filter(|l| l.reason == reason).count();
    assert_eq!([count(&clips, ""), count(&clips, "no sound"), count(&clips, "prediction")], [3, 1, 4]);
    for (key, (sample, _)) in samples(&dir.path().join("clips")) {
        let name = sample.meta["imported"]["motion"].as_str().unwrap().to_owned();
        let captured = captured::read(MotionKind::Authors, &data.join("released_clips").join(name)).unwrap();
        assert_eq!(max_difference(&sample.motion, &expected(&captured, sample.n_frames())), 0.0, "{key}");
    }
    let ted = imported(&[&data.join("speech_motion/ted_expressive")], &dir.path().join("ted"));
    assert_eq!((count(&ted, ""), ted.lines.len()), (14, 14));
    for (key, (sample, _)) in samples(&dir.path().join("ted")) {
        let name = sample.meta["imported"]["motion"].as_str().unwrap().to_owned();
        let mut source =
            captured::read(MotionKind::Ted, &data.join("speech_motion/ted_expressive").join(name)).unwrap().motion;
        source.joints = source.joints.slice(ndarray::s![..sample.n_frames(), .., ..]).to_owned();
        source.mask = source.mask.slice(ndarray::s![..sample.n_frames(), ..]).to_owned();
        assert!(max_difference(&sample.motion, &source) < 1e-6, "{key}");
        let n_visible = |root: usize| (0..21).filter(|k| sample.motion.mask[[0, root + k]]).count();
        assert_eq!((n_visible(L_HAND), n_visible(R_HAND)), (16, 16), "three joints a finger, no tips");
        assert!(!sample.meta["text"].as_str().unwrap().is_empty());
    }
}

#[test]
fn the_command_reports_failures_and_replaces_only_datasets() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path().join("in/good.bvh"), &bvh(160));
    wav(&dir.path().join("in/good.wav"), 5.3, 1);
    write(dir.path().join("in/bad.bvh"), "no bvh");
    let run = |args: &[&str]| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_orator"));
        let output =
            command.current_dir(dir.path()).args(["--json", "import", "--speaker", "host"]).args(args).output();
        let output = output.unwrap();
        (output.status.code(), serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap_or_default())
    };
    let (code, json) = run(&["in", "--out", "out"]);
    assert_eq!((code, json["imported"].as_u64(), json["failed"].as_u64()), (Some(2), Some(1), Some(1)));
    assert_eq!(run(&["in", "--out", "out"]).0, Some(1), "the folder is not empty");
    let ledger = fs::read_to_string(dir.path().join("out/ledger.jsonl")).unwrap();
    assert!(ledger.contains("bad.bvh is not a valid BVH") && !ledger.contains("in/"), "{ledger}");
    assert_eq!(run(&["in/good.bvh", "--out", "out", "--force"]).0, Some(0));
    assert_eq!(run(&["in", "out", "--out", "out", "--force"]).0, Some(1), "the output is an input");
    let (code, json) = run(&["in", "--out", "in", "--force"]);
    assert!(code == Some(1) && json["error"].as_str().unwrap().contains("not a dataset"), "{json}");
    let (code, json) = run(&["in/bad.bvh", "--out", "none"]);
    assert!(code == Some(1) && json["error"].as_str().unwrap().contains("bad.bvh"), "{json}");
    assert!(!dir.path().join("none").exists() && !dir.path().join(".none.attempt").exists());
}

#[test]
fn a_dataset_without_audio_is_rejected_by_training() {
    let dir = tempfile::tempdir().unwrap();
    let source = dir.path().join("trn");
    for (name, n_frames) in [("one", 200), ("two", 230)] {
        write(source.join(format!("{name}.bvh")), &bvh(n_frames));
    }
    let out = dir.path().join("out");
    fs::create_dir_all(&out).unwrap();
    let mut plan = plan(&[&source]);
    plan.limits.no_sound = true;
    let answer = import(&plan, &out, &Silent).unwrap();
    assert!(answer.lines.iter().all(|line| line.outcome == "kept"), "{:?}", answer.lines);
    assert_eq!(verify(&out, true, &Silent).unwrap().problems, []);
    assert!(samples(&out).values().all(|(sample, _)| sample.sound.samples.iter().all(|s| *s == 0.0)));
    assert!(fs::read_to_string(out.join("README.md")).unwrap().contains("There is no sound"));
    let dataset = orator_dataset::Dataset::open(&out).unwrap();
    let settings = orator_dataset::config::Settings::default().gan;
    let error = crate::fixtures::models::training::train_gan(&dataset, &settings, &dir.path().join("gan"), &Silent)
        .err()
        .unwrap();
    assert!(error.to_string().contains("imported without audio"), "{error:#}");
}
