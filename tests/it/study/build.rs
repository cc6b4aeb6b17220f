//! `orator study build`: a sealed folder whose films reveal nothing, with identical bytes after an interruption and for
//! any number of workers.

use crate::fixtures::faults::stop::{Shared, Stop};
use crate::fixtures::study::films::{SIZE, speaker};
use orator_base::stage::progress::{Progress, Silent};
use orator_study::build::build;
use orator_study::file::StudyFile;
use orator_study::folder::StudyFolder;
use orator_study::pages::assets::SOUND_CHECK_TONES;
use orator_study::plan::{FilmSound, StudyKey, StudyPlan};
use orator_study::seal::StudySeal;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::process::{Command, Output};

/// Study with few short films: two tasks, one of them without sound.
const STUDY: &str = r#"
title = "Is it real?"
seed = 3
participants = 4
attention_checks = 1
task_order = "written"
[clips]
seconds = 1.0
[[speaker]]
name = "host"
dataset = "data"
[[condition]]
name = "real"
kind = "natural"
[[condition]]
name = "model"
kind = "checkpoint"
checkpoint = "models/{speaker}"
[[condition]]
name = "mismatched"
kind = "mismatched"
of = "real"
[[task]]
name = "real-or-generated"
design = "turing"
conditions = ["real", "model"]
trials = 3
[[task]]
name = "fits"
design = "mismatch"
conditions = ["real", "mismatched"]
trials = 2
training = 1
"#;

fn file(dir: &Path) -> StudyFile {
    let path = dir.join("study.toml");
    if !path.exists() {
        speaker(dir);
        fs::write(&path, STUDY).unwrap();
    }
    StudyFile::read(&path).unwrap()
}

/// Contents of the files below a folder, except its lock.
fn contents(dir: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    let mut waiting = vec![dir.to_owned()];
    while let Some(folder) = waiting.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => waiting.push(path),
                false => {
                    let name = path.strip_prefix(dir).unwrap().display().to_string();
                    all.insert(name, fs::read(&path).unwrap());
                }
            }
        }
    }
    all.remove(".lock");
    all
}

fn orator(dir: &Path, args: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_orator")).args(args.split_whitespace()).current_dir(dir).output().unwrap()
}

#[test]
fn a_study_is_sealed_and_identical_after_an_interruption() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let file = file(dir);
    let study = StudyFolder::new(dir.join("study"));
    let built = build(&file, study.dir(), SIZE, &Silent).unwrap();
    let seal = StudySeal::verify(&study).unwrap();
    assert_eq!((built.seal.as_str(), built.up_to_date), (seal.seal.as_str(), false));

    // Participants can access only the films of the plan, all of one size and with opaque names.
    let plan: StudyPlan = serde_json::from_slice(&fs::read(study.plan()).unwrap()).unwrap();
    let key: StudyKey = serde_json::from_slice(&fs::read(study.key()).unwrap()).unwrap();
    let films = contents(&study.public());
    let planned = plan.sessions.iter().flat_map(|session| &session.trials).flat_map(|trial| &trial.films);
    let planned: BTreeSet<String> =
        planned.chain([&plan.sound_check]).map(|film| format!("films/{film}.mp4")).collect();
    assert_eq!(films.keys().cloned().collect::<BTreeSet<_>>(), planned);
    assert_eq!(key.films.len(), films.len());
    assert!(films.values().all(|film| film.len() as u64 == built.film_bytes));
    let is_opaque = |name: &&String| name.len() == 16 && name.bytes().all(|digit| digit.is_ascii_hexdigit());
    assert_eq!(key.films.keys().filter(is_opaque).count(), key.films.len());
    for (name, content) in &key.films {
        assert_eq!(content.motion_of != content.clip, content.condition == "mismatched", "{name}");
        let sealed = seal.files.get(&format!("public/films/{name}.mp4")).unwrap();
        assert_eq!(*sealed, blake3::hash(&films[&format!("films/{name}.mp4")]).to_hex().to_string());
    }
    assert!(key.films.values().any(|content| content.number.is_some()));
    // The sound check asks for the number of tones.
    assert_eq!(key.films[&plan.sound_check].sound, FilmSound::Tones);
    let sound_check = orator::read_sound(&study.film(&plan.sound_check)).unwrap();
    let loudest = sound_check.samples.iter().fold(0f32, |most, sample| most.max(sample.abs()));
    let steps = sound_check.samples.chunks(sound_check.rate as usize / 50);
    let is_loud: Vec<bool> = steps.map(|step| step.iter().any(|sample| sample.abs() > loudest / 2.0)).collect();
    assert_eq!(is_loud.windows(2).filter(|pair| !pair[0] && pair[1]).count(), SOUND_CHECK_TONES);
    let complete = contents(study.dir());
    assert!(complete.keys().all(|name| !name.contains(".films")), "intermediate files are removed");
    assert!(complete.contains_key("clips/clips.json") && complete.keys().any(|name| name.ends_with(".wav")));

    // The same study is up to date; another study in the same folder is rejected.
    let output = orator(dir, "--json study build study.toml");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let facts: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((facts["seal"].as_str(), facts["up_to_date"].as_bool()), (Some(seal.seal.as_str()), Some(true)));
    assert_eq!(facts["next"], "orator study serve study");
    let other = StudyFile { participants: 5, ..file.clone() };
    let error = build(&other, study.dir(), SIZE, &Silent).unwrap_err().to_string();
    assert!(error.contains("is sealed") && error.contains("--out"), "{error}");

    // Interrupted while films are rendered, then completed by one worker.
    let again = dir.join("again");
    let stopped = catch_unwind(AssertUnwindSafe(|| build(&file, &again, SIZE, &Shared(Stop::at(31)) as &dyn Progress)));
    assert!(stopped.is_err() && !again.join("seal.json").exists() && !again.join("public").exists());
    let rendered = contents(&again.join(".films"));
    assert!(!rendered.is_empty());
    // Other workers may have rendered all other films before they ended.
    fs::remove_file(again.join(".films").join(rendered.keys().next_back().unwrap())).unwrap();
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    one.install(|| build(&file, &again, SIZE, &Silent)).unwrap();
    let again = contents(&again);
    assert_eq!(again.keys().collect::<Vec<_>>(), complete.keys().collect::<Vec<_>>());
    let different: Vec<&String> = complete.keys().filter(|name| complete[*name] != again[*name]).collect();
    assert!(different.is_empty(), "{different:?}");
    fs::write(study.film("0000000000000000"), "planted").unwrap();
    assert!(build(&file, study.dir(), SIZE, &Silent).unwrap_err().to_string().contains("0000000000000000"));
}

/// The program is sandboxed, unlike the library.
#[test]
fn the_command_line_builds_a_study() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    speaker(dir);
    let (head, _) = STUDY.split_once("[[task]]").unwrap();
    let head = head.replace("attention_checks = 1", "attention_checks = 0\npractice = false");
    let head = head.replace("seconds = 1.0", "seconds = 1.0\nmismatched = \"per-participant\"");
    let task =
        "[[task]]\nname = \"fits\"\ndesign = \"mismatch\"\nconditions = [\"real\", \"mismatched\"]\ntrials = 2\n";
    fs::write(dir.join("study.toml"), head.replace("participants = 4", "participants = 1") + task).unwrap();
    let output = orator(dir, "study build study.toml --out made/here");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let study = StudyFolder::new(dir.join("made/here"));
    let seal = StudySeal::verify(&study).unwrap();
    // The films of two trials, in which each clip can have only the other one's motion, and that of the sound check.
    let key: StudyKey = serde_json::from_slice(&fs::read(study.key()).unwrap()).unwrap();
    let shown: Vec<[&str; 3]> =
        key.films.values().map(|film| [&*film.condition, &*film.clip, &*film.motion_of]).collect();
    let natural: Vec<_> = shown.iter().filter(|film| film[0] == "real").collect();
    assert!(shown.len() == 5 && natural.len() == 3 && natural.iter().all(|film| film[1] == film[2]), "{shown:?}");
    for [_, clip, of] in shown.iter().filter(|film| film[0] == "mismatched") {
        assert!(clip != of && natural.iter().any(|film| film[1] == *of), "{shown:?}");
    }
    assert!(text.contains("host: 3 clips") && text.contains(&seal.seal), "{text}");
    assert!(text.contains("next: orator study serve made/here"), "{text}");
}

#[test]
fn errors_name_the_missing_input() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let file = file(dir);
    let error_of = |change: &dyn Fn(&mut StudyFile)| {
        let mut changed = file.clone();
        change(&mut changed);
        format!("{:#}", build(&changed, &dir.join("out"), SIZE, &Silent).unwrap_err())
    };
    let cases: [(&str, String); 5] = [
        ("clips per speaker are needed", error_of(&|file| file.task[0].trials = 400)),
        ("shorter clips", error_of(&|file| file.clips.seconds = 30.0)),
        ("is not a dataset", error_of(&|file| file.speaker[0].dataset = Some(dir.join("nowhere")))),
        (
            "condition model",
            error_of(&|file| fs::rename(dir.join("models"), dir.join("moved")).map(|()| file.seed = 9).unwrap()),
        ),
        (
            "has no interval in the validation split",
            error_of(&|file| {
                fs::rename(dir.join("moved"), dir.join("models")).unwrap();
                file.speaker[0].split = orator_base::types::split::Split::Validation;
            }),
        ),
    ];
    for (expected, text) in cases {
        assert!(text.contains(expected), "{expected}: {text}");
    }
    let output = orator(dir, "study build nothing.toml");
    assert_eq!(output.status.code(), Some(1));
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(text.contains("nothing.toml") && text.contains("orator guide study"), "{text}");
}
