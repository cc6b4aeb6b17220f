//! Thresholds changed after a run: `status --why` names the key and says which stages would run, `run` runs those and
//! never pose2d; and the account of seconds in `status` adds up, with failures in it.

use orator_test_support::project::{ProgramAnswer, Project, files_under};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;

/// Of each stage how many units stay fresh, how many would run, and why.
fn plan(answer: &ProgramAnswer) -> BTreeMap<String, (u64, u64, String)> {
    let of = |stage: &Value| {
        let why = stage["reasons"].as_array().unwrap().iter().map(|why| why.as_str().unwrap());
        let n = |key: &str| stage[key].as_u64().unwrap();
        let name = stage["stage"].as_str().unwrap().to_owned();
        (name, (n("up_to_date"), n("would_run"), why.collect::<Vec<_>>().join("; ")))
    };
    answer.json["plan"].as_array().unwrap().iter().map(of).collect()
}

/// Every file of a stage with its content.
fn made(project: &Project, stage: &str) -> Vec<(String, Vec<u8>)> {
    let files = files_under(&project.work().join(stage));
    files.into_iter().map(|(name, path)| (name, fs::read(path).unwrap())).collect()
}

#[test]
fn a_changed_threshold_runs_segment_and_what_follows_and_never_pose2d() {
    let project = Project::with_clips("redecide", 1, 6.0);
    assert_eq!(project.run(&[]).code, 0);
    let (extract, pose2d) = (made(&project, "extract"), made(&project, "pose2d"));
    let changes = [
        // (key, was, now, the first stage it concerns, units that lift does again: none where the verdict is the same)
        ("shot_threshold", "0.2", "0.3", "segment", 0),
        ("min_frames", "64", "70", "segment", 1),
        ("max_bone_change", "0.4", "0.45", "lift", 1),
        ("min_sound_db", "-50.0", "-1.0", "segment", 1),
    ];
    let mut set: Vec<String> = Vec::new();
    for (key, was, now, first, n_lifted) in changes {
        let section = first;
        set.extend(["--set".to_owned(), format!("{section}.{key}={now}")]);
        let set: Vec<&str> = set.iter().map(String::as_str).collect();
        let told = plan(&project.answer(&[&["status", "--why"], &set[..]].concat()));
        let expected = format!("{section}.{key} changed from {was} to {now}");
        for fresh in ["extract", "pose2d"] {
            assert_eq!((told[fresh].0, told[fresh].1), (1, 0), "{key}: {told:?}");
        }
        assert_eq!((told[first].1, told[first].2.as_str()), (1, expected.as_str()), "{key}");
        assert_eq!(told["segment"].1, u64::from(first == "segment"), "{key}");
        for after in ["lift", "dataset"] {
            assert_eq!(told[after].1, 1, "{key}: {told:?}");
        }
        let answer = project.run(&set);
        // at -1 dB all is too quiet, and there is no dataset
        assert_eq!(answer.code, if key == "min_sound_db" { 2 } else { 0 }, "{}", answer.errors);
        let done = |stage: &str| answer.json["stages"][stage]["done"].as_u64().unwrap();
        assert_eq!((done("extract"), done("pose2d"), done("segment")), (0, 0, u64::from(first == "segment")), "{key}");
        assert_eq!((done("lift"), made(&project, "pose2d") == pose2d), (n_lifted, true), "{key}");
    }
    assert!(made(&project, "extract") == extract);
}

#[test]
fn every_second_is_in_the_account() {
    let project = Project::with_clips("account", 2, 6.0);
    let clips = project.clips();
    fs::write(project.video("text.mp4"), "this is no video\n").unwrap();
    let status = || {
        let answer = project.answer(&["status"]);
        let of = |fact: &Value| (fact["unit"].as_str().unwrap().to_owned(), fact.clone());
        let facts: BTreeMap<String, Value> = answer.json["time_budget"].as_array().unwrap().iter().map(of).collect();
        assert_eq!(answer.json["adds_up"], true);
        facts["host"].clone()
    };
    let secs = |fact: &Value, key: &str| fact[key].as_f64().unwrap();
    let before = status();
    assert!((secs(&before, "waiting_secs") - 12.0).abs() < 0.2 && before["unknown_durations"] == 1, "{before}");
    assert_eq!(project.run(&[]).code, 2);
    let after = status();
    let refused: f64 = after["rejected_secs"].as_object().unwrap().values().map(|v| v.as_f64().unwrap()).sum();
    assert!((secs(&after, "accepted_secs") + refused - 12.0).abs() < 0.2, "{after}");
    assert!(secs(&after, "waiting_secs") == 0.0 && after["unknown_durations"] == 1, "{after}");
    // a stage that fails takes its whole video: the length is known from the stage before
    let keypoints = files_under(&project.work().join("pose2d")).into_iter().find(|(name, _)| name.ends_with(".npz"));
    fs::remove_file(keypoints.unwrap().1).unwrap();
    let models = project.dir().join("models");
    fs::rename(&models, project.dir().join("gone")).unwrap();
    let failed = status();
    assert!(secs(&failed, "failed_secs") + secs(&failed, "waiting_secs") > 5.8, "{failed}");
    assert!((secs(&failed, "sum_secs") - 12.0).abs() < 0.2 && clips.len() == 2, "{failed}");
}

#[test]
fn after_a_run_of_two_speakers_nothing_is_stale() {
    let project = Project::with_clips("speakers", 1, 5.0);
    let other = project.dir().join("videos/guest.mp4");
    fs::copy(&project.clips()[0], other).unwrap();
    let file = project.dir().join("pipeline.toml");
    let text = fs::read_to_string(&file).unwrap();
    let guest = "[[speaker]]\nname = \"guest\"\nvideos = [\"videos/guest.mp4\"]\ntrain = [\"*.mp4\"]\n";
    fs::write(&file, text + "\n" + guest).unwrap();
    let answer = project.run(&[]);
    assert_eq!(answer.code, 0, "{}", answer.errors);
    let status = project.answer(&["status"]).json;
    let states: Vec<&str> =
        status["units"].as_array().unwrap().iter().filter_map(|unit| unit["state"].as_str()).collect();
    assert!(states.len() == 10 && states.iter().all(|state| *state == "fresh"), "{status}");
}
