//! Readers of text files: transcripts, JSON keypoints, configuration, manifest, tables, evaluation results, logs.

use crate::fixtures::fuzzing::harness::{corpus, folder, fuzz_bytes, fuzz_file};
use orator_formats::keypoints;
use orator_formats::transcript::Transcript;
use orator_gesture::batch::sounds;
use orator_gesture::evaluate::table::result::StoredResult;
use orator_onnx::Manifest;

#[test]
fn transcripts() {
    let files = corpus("texts", "words");
    let dir = folder();
    fuzz_bytes("transcripts", &files, |bytes| {
        for ending in ["srt", "vtt", "TextGrid", "tsv", "ctm", "json", "txt"] {
            let path = dir.path().join(format!("a.{ending}"));
            std::fs::write(&path, bytes).unwrap();
            if let Ok(transcript) = Transcript::read(&path) {
                let words = &transcript.until(10.0).words;
                assert!(words.iter().all(|word| word.start_secs.is_finite() && word.end_secs.is_finite()));
            }
        }
    });
}

#[test]
fn external_keypoints() {
    let files = corpus("texts", "keypoints");
    fuzz_file("external_keypoints", &files, "a.json", |path| drop(keypoints::read(path)));
}

#[test]
fn configuration() {
    fuzz_file("configuration", &corpus("texts", "pipeline"), "pipeline.toml", |path| {
        let _ = orator_dataset::config::load(path, &[]);
    });
}

#[test]
fn settings_on_the_command_line() {
    let files = [b"extract.fps=15".to_vec(), b"segment.shot_threshold=0.5".to_vec(), b"work.dir=\"a\"".to_vec()];
    let dir = folder();
    let file = dir.path().join("pipeline.toml");
    std::fs::write(&file, "[[speaker]]\nname = \"host\"\nvideos = []\n").unwrap();
    fuzz_bytes("settings_on_the_command_line", &files, |bytes| {
        let _ = orator_dataset::config::load(&file, &[String::from_utf8_lossy(bytes).into_owned()]);
    });
}

#[test]
fn manifest() {
    fuzz_bytes("manifest", &corpus("texts", "manifest"), |bytes| {
        let _ = Manifest::parse(&String::from_utf8_lossy(bytes));
    });
}

#[test]
fn audio_table() {
    fuzz_file("audio_table", &corpus("texts", "sounds"), "sounds.csv", |path| {
        for row in sounds::of_table(path).unwrap_or_default() {
            assert!(!row.name.starts_with('/') && !row.name.split('/').any(|part| part == ".."), "{}", row.name);
        }
    });
}

#[test]
fn evaluation_result() {
    fuzz_file("evaluation_result", &corpus("texts", "result"), "result.json", |path| {
        let _ = StoredResult::read(path);
    });
}

#[test]
fn training_log() {
    fuzz_file("training_log", &corpus("texts", "log"), "log.jsonl", |path| {
        let _ = orator_gesture::train::log::read(path.parent().unwrap());
    });
}
