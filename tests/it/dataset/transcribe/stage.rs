//! `transcripts = "auto"`: the stage transcribe recognises the words, which then reach dataset, card, report and status;
//! other speakers have no such stage.

use crate::fixtures::footage::{good, write};
use crate::fixtures::media::lifted_videos::unit;
use crate::fixtures::media::recogniser::{MODEL, project_with_words, write_recogniser};
use orator_base::stage::artifacts::Artifact;
use orator_base::stage::progress::Silent;
use orator_base::stage::{Stage, Unit};
use orator_dataset::Dataset;
use orator_dataset::config::Settings;
use orator_formats::media_json::MediaInfo;
use orator_formats::transcript::{Transcript, Word};
use orator_pipeline::transcribe::TranscribeStage;
use orator_test_support::project::Project;
use serde_json::{Value, json};
use std::fs;
use std::path::Path;

/// State of each unit at the stage transcribe.
fn states(project: &Project, args: &[&str]) -> Vec<Value> {
    let status = project.answer(&[&["status"], args].concat());
    assert_eq!(status.code, 0, "{}", status.errors);
    let units = status.json["units"].as_array().unwrap();
    units.iter().filter(|unit| unit["stage"] == "transcribe").map(|unit| unit["state"].clone()).collect()
}

#[test]
fn recognised_words_reach_the_dataset_and_the_report() {
    let project = project_with_words("words", 2, 4.6);
    let run = project.run(&[]);
    assert_eq!((run.code, &run.json["stages"]["transcribe"]["done"]), (0, &json!(2)), "{}", run.errors);
    let n_words = project.clips().into_iter().map(|clip| {
        let stem = clip.file_stem().unwrap().to_str().unwrap();
        let words = Transcript::read(&project.written("transcribe", stem, "words.json")).unwrap().words;
        assert!(words.iter().all(|word| word.word == "the" && word.end_secs <= 4.7), "{words:?}");
        words.len()
    });
    assert_eq!(n_words.sum::<usize>(), 4);
    let dir = project.work().join("dataset/host");
    let dataset = Dataset::open(&dir).unwrap();
    assert_eq!(dataset.stats().footage.words.unwrap().n_words, 4);
    let recogniser = dataset.info().models.iter().find(|model| model.role == "words").unwrap();
    assert_eq!((recogniser.id.as_str(), recogniser.sha256.len()), (MODEL, 64));
    let card = fs::read_to_string(dir.join("README.md")).unwrap();
    let note = format!("The words were recognised by {MODEL} (sha256 {}).", recogniser.sha256);
    assert!(card.contains(&note), "{card}");
    drop(dataset);

    assert_eq!(states(&project, &[]), ["fresh", "fresh"]);
    assert_eq!(states(&project, &["--set", "transcribe.language=en"]), ["stale", "stale"]);
    assert_eq!(project.run(&[]).json["stages"]["transcribe"]["up_to_date"], 2);
    assert_eq!(project.answer(&["report"]).code, 0);
    let page = fs::read_to_string(project.work().join("report.html")).unwrap();
    assert!(page.contains(" of 2 words") && page.contains("\nthe"), "{page:.2000}");
}

#[test]
fn without_recognition_there_is_no_such_stage() {
    let project = Project::with_clips("no-words", 1, 1.0);
    let run = project.run(&["--to", "transcribe"]);
    assert_eq!((run.code, run.json["stages"].get("transcribe")), (0, None), "{}", run.errors);
    assert!(states(&project, &[]).is_empty() && !project.work().join("transcribe").exists());
    let plan = project.answer(&["plan"]);
    assert_eq!((plan.code, plan.json["stages"].get("transcribe")), (0, None), "{}", plan.errors);
    let only = project.run(&["--only", "transcribe"]);
    assert!(only.code == 1 && only.errors.contains("`transcripts = \"auto\"`"), "{}", only.errors);
}

#[test]
fn a_missing_recogniser_is_reported_before_any_work() {
    let project = project_with_words("no-recogniser", 1, 1.0);
    fs::remove_dir_all(project.dir().join("models").join(MODEL)).unwrap();
    for (set, expected) in [
        ("transcribe.model=auto", "`orator models fetch whisper-base`"),
        ("transcribe.model=whisper-tiny-en", "`orator models fetch whisper-tiny-en`"),
        ("transcribe.language=en", MODEL),
    ] {
        let run = project.run(&["--set", set]);
        assert!(run.code == 1 && run.errors.contains(expected), "{set}: {}", run.errors);
    }
    assert!(!project.work().join("extract").exists());
    // The other stages do not need it.
    assert_eq!(project.run(&["--to", "segment"]).code, 0);
}

/// Words that the stage writes for a video with this audio whose first image is at `first_image_secs`.
fn recognised(root: &Path, unit: &Unit, sound: Option<Vec<i16>>, first_image_secs: f64) -> (Vec<Word>, String) {
    let mut settings = Settings::default();
    (settings.work.dir, settings.models.dir) = (root.join("work"), root.join("models"));
    MODEL.clone_into(&mut settings.transcribe.model);
    let mut footage = good(60);
    footage.sound = sound;
    write(&settings.work.dir, unit, &footage, "a film");
    let path = Artifact::MediaInfo.path(&settings.work.dir, unit);
    MediaInfo { first_image_secs, ..MediaInfo::read(&path).unwrap() }.write(&path).unwrap();
    let stage = TranscribeStage::new(&settings, None).unwrap();
    let out = tempfile::tempdir().unwrap();
    assert!(stage.inputs(unit).unwrap().iter().all(|input| input.path.exists()));
    let report = stage.run(unit, out.path(), &Silent).unwrap();
    let transcript = Transcript::read(&Artifact::Words.within(out.path())).unwrap();
    assert_eq!(report.facts["n_words"], transcript.words.len());
    (transcript.words, transcript.notes.join("; "))
}

#[test]
fn words_are_on_the_clock_of_the_file_and_silence_has_none() {
    let root = tempfile::tempdir().unwrap();
    write_recogniser(&root.path().join("models").join(MODEL));
    let unit = unit(root.path(), "talk");
    let (words, notes) = recognised(root.path(), &unit, good(60).sound, 0.0);
    assert_eq!((words.len(), notes.as_str()), (2, ""));
    let (moved, _) = recognised(root.path(), &unit, good(60).sound, 1.5);
    for (word, moved) in words.iter().zip(&moved) {
        assert!((moved.start_secs - word.start_secs - 1.5).abs() < 2e-3 && moved.end_secs >= 1.5, "{word:?} {moved:?}");
    }
    for sound in [None, Some(vec![0; 64_000]), Some(Vec::new())] {
        assert_eq!(recognised(root.path(), &unit, sound, 0.0), (Vec::new(), "the transcript holds no word".to_owned()));
    }
}
