//! Thresholds changed after a run: `status --why` names the key and the stages that would run, and `run` runs exactly
//! those, never pose2d. Also the time budget of `status`, which adds up even with failures.

use orator_test_support::project::{ProgramAnswer, Project, files_under};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;

/// For each stage the number of fresh units, the number of units that would run, and the reasons.
fn plan(answer: &ProgramAnswer) -> BTreeMap<String, (u64, u64, String)> {
    let of = |stage: &Value| {
        let reasons = stage["reasons"].as_array().unwrap().iter().map(|reason| reason.as_str().unwrap());
        let count = |key: &str| stage[key].as_u64().unwrap();
        let name = stage["stage"].as_str().unwrap().to_owned();
        (name, (count("up_to_date"), count("would_run"), reasons.collect::<Vec<_>>().join("; ")))
    };
    answer.json["plan"].as_array().unwrap().iter().map(of).collect()
}

/// Every file of a stage with its content.
fn stage_files(project: &Project, stage: &str) -> Vec<(String, Vec<u8>)> {
    let files = files_under(&project.work().join(stage));
    files.into_iter().map(|(name, path)| (name, fs::read(path).unwrap())).collect()
}

#[test]
fn a_changed_threshold_runs_only_the_stages_that_depend_on_it() {
    let project = Project::with_clips("redecide", 1, 6.0);
    assert_eq!(project.run(&[]).code, 0);
    let (extract, pose2d) = (stage_files(&project, "extract"), stage_files(&project, "pose2d"));
    let changes = [
        // (key, old value, new value, first stage that uses it, units that lift runs: 0 if the intervals are unchanged)
        ("shot_threshold", "0.2", "0.3", "segment", 0),
        ("min_frames", "64", "70", "segment", 1),
        ("max_bone_change", "0.4", "0.45", "lift", 1),
        ("min_sound_db", "-50.0", "-1.0", "segment", 1),
    ];
    let mut set: Vec<String> = Vec::new();
    for (key, old, new, first, n_lifted) in changes {
        let section = first;
        set.extend(["--set".to_owned(), format!("{section}.{key}={new}")]);
        let set: Vec<&str> = set.iter().map(String::as_str).collect();
        let planned = plan(&project.answer(&[&["status", "--why"], &set[..]].concat()));
        let expected = format!("{section}.{key} changed from {old} to {new}");
        for fresh in ["extract", "pose2d"] {
            assert_eq!((planned[fresh].0, planned[fresh].1), (1, 0), "{key}: {planned:?}");
        }
        assert_eq!((planned[first].1, planned[first].2.as_str()), (1, expected.as_str()), "{key}");
        assert_eq!(planned["segment"].1, u64::from(first == "segment"), "{key}");
        for after in ["lift", "dataset"] {
            assert_eq!(planned[after].1, 1, "{key}: {planned:?}");
        }
        let answer = project.run(&set);
        // At -1 dB everything is too quiet, so there is no dataset.
        assert_eq!(answer.code, if key == "min_sound_db" { 2 } else { 0 }, "{}", answer.errors);
        let done = |stage: &str| answer.json["stages"][stage]["done"].as_u64().unwrap();
        assert_eq!((done("extract"), done("pose2d"), done("segment")), (0, 0, u64::from(first == "segment")), "{key}");
        assert_eq!((done("lift"), stage_files(&project, "pose2d") == pose2d), (n_lifted, true), "{key}");
    }
    assert!(stage_files(&project, "extract") == extract);
}

#[test]
fn every_second_is_in_the_time_budget() {
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
    let rejected: f64 = after["rejected_secs"].as_object().unwrap().values().map(|v| v.as_f64().unwrap()).sum();
    assert!((secs(&after, "accepted_secs") + rejected - 12.0).abs() < 0.2, "{after}");
    assert!(secs(&after, "waiting_secs") == 0.0 && after["unknown_durations"] == 1, "{after}");
    // A failed stage counts its full video, whose duration is known from the preceding stage.
    let keypoints = files_under(&project.work().join("pose2d")).into_iter().find(|(name, _)| name.ends_with(".npz"));
    fs::remove_file(keypoints.unwrap().1).unwrap();
    let models = project.dir().join("models");
    fs::rename(&models, project.dir().join("gone")).unwrap();
    let failed = status();
    assert!(secs(&failed, "failed_secs") + secs(&failed, "waiting_secs") > 5.8, "{failed}");
    assert!((secs(&failed, "sum_secs") - 12.0).abs() < 0.2 && clips.len() == 2, "{failed}");
}

#[test]
fn after_a_run_of_two_speakers_all_units_are_fresh() {
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
