//! `orator dataset annotate`: its ELAN files read in Python by `pympi-ling` from PyPI (`make readers`), and its table.

use crate::fixtures::animation::known_strokes::{SpeakerRecipe, speaker};
use crate::fixtures::clips::tone;
use ndarray::{Array3, s};
use orator_base::stage::ledger::{AcceptedInterval, Ledger, RejectedInterval};
use orator_base::stage::rejection::{FrameRejection, Rejection};
use orator_base::types::pose3d::Motion;
use orator_base::types::sound::sample_at;
use orator_dataset::bones::VideoBones;
use orator_dataset::info::About;
use orator_dataset::split::SplitBy;
use orator_dataset::write::assemble::DatasetWriter;
use orator_dataset::write::entry::VideoSource;
use orator_dataset::{Sample, Split};
use orator_formats::eaf::{self, Annotation, AnnotationTier};
use orator_formats::transcript::{Word, WordSource};
use orator_test_support::skip::readers;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

/// Prints the media links, the times that are out of order, and the annotations of each tier in milliseconds.
const READ: &str = r"
import json, sys, warnings
warnings.simplefilter('error')
from pympi.Elan import Eaf
eaf = Eaf(sys.argv[1])
times = list(eaf.timeslots.values())
tiers = [[name, sorted(eaf.get_annotation_data_for_tier(name))] for name in eaf.get_tier_names()]
print(json.dumps({'media': eaf.media_descriptors, 'is_ordered': times == sorted(times), 'n_slots': len(times),
                  'n_annotations': len(eaf.annotations), 'tiers': tiers}))
";

type ReadTiers = Vec<(String, Vec<(u64, u64, String)>)>;

fn read(readers: &Path, path: &Path) -> (Value, ReadTiers) {
    let output = Command::new("python3").args(["-c", READ]).arg(path).env("PYTHONPATH", readers).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["is_ordered"], true);
    let tiers: ReadTiers = serde_json::from_value(found["tiers"].clone()).unwrap();
    // Ids are unique, and annotations share no time slots.
    let n: usize = tiers.iter().map(|(_, annotations)| annotations.len()).sum();
    assert_eq!((&found["n_annotations"], &found["n_slots"]), (&n.into(), &(2 * n).into()));
    (found, tiers)
}

#[test]
fn annotations_are_read_back_with_any_text_and_without_overlaps() {
    let Some(readers) = readers("pympi") else { return };
    let annotation =
        |start_secs: f64, end_secs: f64, value: &str| Annotation { start_secs, end_secs, value: value.into() };
    let words = vec![
        annotation(1.5, 1.75, "second\n\u{1}line"),
        annotation(0.0004, 0.25, "<&> \"quoted\" 'it' \u{e4}\u{1f600}"),
        annotation(0.2, 0.9996, ""),
        annotation(0.9996, 0.9996, "instant"),
    ];
    let tiers = [
        AnnotationTier { name: "words & <more>".into(), annotations: words },
        AnnotationTier { name: "empty".into(), annotations: Vec::new() },
    ];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.eaf");
    std::fs::write(&path, eaf::write("../videos/a & b.mp4", &tiers)).unwrap();
    let (found, tiers) = read(&readers, &path);
    let media = &found["media"][0];
    assert_eq!(
        (&media["RELATIVE_MEDIA_URL"], &media["MIME_TYPE"]),
        (&"../videos/a & b.mp4".into(), &"video/mp4".into())
    );
    let row = |start, end, value: &str| (start, end, value.to_owned());
    let expected = vec![
        row(0, 250, "<&> \"quoted\" 'it' \u{e4}\u{1f600}"),
        row(250, 1000, ""),
        row(1000, 1001, "instant"),
        row(1500, 1750, "second line"),
    ];
    assert_eq!(tiers, [("words & <more>".to_owned(), expected), ("empty".to_owned(), Vec::new())]);
}

/// Dataset of a video with two samples, 0 to 20 s and 25 to 45 s; 20 to 25 s are rejected. The samples have words.
fn write_dataset(dir: &Path) {
    let recipe = SpeakerRecipe { seed: 7, fps: 15, secs: 45.0, noise: 0.003, correlation_secs: 0.0, skew: 1.0 };
    let (motion, _) = speaker(recipe);
    let fps = motion.fps;
    let sample = |start: usize, end: usize| {
        let n_frames = end - start;
        let joints = motion.joints.slice(s![start..end, .., ..]).to_owned();
        let word = |n: usize| Word {
            word: format!("<word{n}>"),
            start_secs: n as f64,
            end_secs: n as f64 + 0.5,
            source: WordSource::Given,
            confidence: None,
        };
        let mut sound = tone(16_000, 21.0, 200.0);
        sound.samples.truncate(sample_at(fps, 16_000, n_frames));
        sound.samples[16_000..24_000].fill(0.0);
        Sample {
            key: format!("talk-00000000-{start:06}"),
            motion: Motion::from_joints(fps, joints),
            pose2d: Array3::zeros((n_frames, 59, 3)),
            sound,
            words: Some((0..19).map(word).collect()),
            posture: None,
            interlocutor: None,
            meta: serde_json::json!({}),
        }
    };
    let why = FrameRejection::new(Rejection::Quiet, -50.0, -40.0);
    let interval = |start_secs, end_secs| AcceptedInterval { start_secs, end_secs };
    let ledger = Ledger {
        duration_secs: 45.0,
        accepted: vec![interval(0.0, 20.0), interval(25.0, 45.0)],
        rejected: vec![RejectedInterval::new(20.0, 25.0, why)],
        ..Ledger::default()
    };
    std::fs::create_dir_all(dir).unwrap();
    let writer = DatasetWriter::new(dir, About::new("host", fps), 256 << 20);
    let source = VideoSource {
        name: "talk-00000000".into(),
        file: "my talk.mp4".into(),
        content: blake3::hash(b"talk").to_hex().to_string(),
        ledger,
        bones: VideoBones { lengths_metres: vec![0.1; 48], n_frames: 600 },
        ..VideoSource::default()
    };
    let mut video = writer.video(source, Split::Train, SplitBy::Name).unwrap();
    [sample(0, 300), sample(375, 675)].iter().for_each(|sample| video.push(sample, 0.0).unwrap());
    video.finish(None).unwrap();
    writer.finish().unwrap();
}

fn annotate(dir: &Path, args: &[&str]) -> (i32, Value, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    let output = command.args(["--json", "dataset", "annotate"]).args(args).current_dir(dir).output().unwrap();
    let json = serde_json::from_slice(&output.stdout).unwrap_or_default();
    (output.status.code().unwrap_or(-1), json, String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn the_annotations_of_a_dataset_are_those_of_its_table() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    write_dataset(&dir.join("data"));
    std::fs::create_dir(dir.join("films")).unwrap();
    std::fs::write(dir.join("films/my talk.mp4"), "video").unwrap();
    let (code, json, errors) = annotate(dir, &["data", "--out", "deep/out", "--videos", "films"]);
    assert_eq!(code, 0, "{errors}");
    let table = std::fs::read_to_string(dir.join("deep/out/phases.csv")).unwrap();
    let mut lines = table.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let columns = lines.next().unwrap();
    let rows: Vec<BTreeMap<String, String>> = lines.map(|row| columns.iter().cloned().zip(row).collect()).collect();
    let number = |row: &BTreeMap<String, String>, column: &str| row[column].parse::<f64>().unwrap();
    assert!(rows.len() > 20 && rows.iter().all(|row| row["video"] == "talk-00000000"));
    for row in &rows {
        let (start, end) = (number(row, "start_s"), number(row, "end_s"));
        assert!((number(row, "duration_s") - (end - start)).abs() < 0.0021, "{row:?}");
        assert!(end <= 20.0 || (start >= 25.0 && end <= 45.0), "{row:?}");
        if row["phase"] == "stroke" {
            // A word starts every second and lasts for half of it.
            let zero = if start < 25.0 { 0.0 } else { 25.0 };
            let index = row["word"].trim_matches(['<', '>']).trim_start_matches("word").parse::<usize>();
            let is_near = |n: usize| {
                let word = zero + n as f64;
                let is_overlapping = word < end && word + 0.5 > start;
                is_overlapping || (word >= start && word - start <= 0.2) || (word < start && start - word <= 0.7)
            };
            assert!(index.map_or_else(|_| !(0..19).any(is_near), is_near), "{row:?}");
        }
    }
    let n_strokes = rows.iter().filter(|row| row["phase"] == "stroke").count();
    let n_bound = rows.iter().filter(|row| !row["word"].is_empty()).count();
    assert_eq!((&json["strokes_with_words"], &json["strokes_bound_to_words"]), (&n_strokes.into(), &n_bound.into()));
    let first = std::fs::read(dir.join("deep/out/talk-00000000.eaf")).unwrap();
    assert_eq!(annotate(dir, &["data", "--out", "deep/out", "--videos", "films"]).0, 0);
    assert_eq!(std::fs::read(dir.join("deep/out/talk-00000000.eaf")).unwrap(), first, "the output is deterministic");
    check_tiers(&dir.join("deep/out/talk-00000000.eaf"), &rows);

    let fails = |args: &[&str], expected: &str| {
        let (code, _, errors) = annotate(dir, args);
        assert!(code == 1 && errors.contains(expected), "{errors}");
    };
    fails(
        &["data", "--out", "deep/out", "--videos", "data"],
        "data has no my talk.mp4: expected the folder with the videos",
    );
    fails(&["data", "--out", "deep/out", "--videos", "none"], "none is not a folder");
    fails(&["data", "--out", "films/my talk.mp4"], "is a file: expected a folder");
    fails(&["data", "--out", "data/new"], "is in the dataset: choose another folder");
    fails(&["films", "--out", "deep/out"], "is not a dataset");
}

fn check_tiers(path: &Path, rows: &[BTreeMap<String, String>]) {
    let Some(readers) = readers("pympi") else { return };
    let (found, tiers) = read(&readers, path);
    assert_eq!(found["media"][0]["RELATIVE_MEDIA_URL"], "../../films/my talk.mp4");
    let names: Vec<&str> = tiers.iter().map(|(name, _)| name.as_str()).collect();
    let phases = ["stroke", "retraction", "hold", "rest"];
    let of_hands = ["left", "right"].into_iter().flat_map(|hand| phases.map(|phase| format!("{phase} {hand}")));
    let expected: Vec<String> =
        ["speech", "words"].map(str::to_owned).into_iter().chain(of_hands).chain(["rejected".to_owned()]).collect();
    assert_eq!(names, expected);
    for (name, annotations) in &tiers[2..10] {
        let (phase, hand) = name.split_once(' ').unwrap();
        let rows = rows.iter().filter(|row| row["phase"] == phase && row["hand"] == hand);
        let ms = |row: &BTreeMap<String, String>, column: &str| (1000.0 * row[column].parse::<f64>().unwrap()).round();
        let expected: Vec<(f64, f64, f64)> =
            rows.map(|row| (ms(row, "start_s"), ms(row, "end_s"), row["confidence"].parse().unwrap())).collect();
        assert_eq!(annotations.len(), expected.len(), "{name}");
        for ((start, end, value), (start_ms, end_ms, confidence)) in annotations.iter().zip(expected) {
            assert!((*start as f64 - start_ms).abs() <= 1.0 && (*end as f64 - end_ms).abs() <= 1.0, "{name}");
            assert!((value.parse::<f64>().unwrap() - confidence).abs() <= 0.006, "{name}");
        }
    }
    let words = &tiers[1].1;
    assert_eq!((words.len(), &words[20]), (38, &(26_000, 26_500, "<word1>".to_owned())));
    // A second without sound divides the speech of each sample.
    let speech: Vec<(u64, u64)> = tiers[0].1.iter().map(|(start, end, _)| (start / 500, end / 500)).collect();
    assert_eq!(speech, [(0, 2), (3, 40), (50, 52), (53, 90)]);
    assert_eq!(tiers[0].1[0].2, "<word0>");
    let expected = "too quiet: too quiet: the sound is at -50 dB, -40 dB is needed";
    assert_eq!(tiers[10].1, [(20_000, 25_000, expected.to_owned())]);
}
