//! A small `make demo-study`: a study is built, served, answered in Chromium with a known preference, and analysed.

use crate::fixtures::study::films::speaker;
use orator_test_support::skip::{browser_driver, skip};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Study with few short films shown side by side, once for a choice and once for a preference.
const STUDY: &str = r#"
title = "Small"
participants = 3
extra_session_ratio = 0.0
attention_checks = 1
task_order = "written"
practice = false
[clips]
seconds = 1.0
[[speaker]]
name = "synthetic"
dataset = "dataset"
[[condition]]
name = "real"
kind = "natural"
[[condition]]
name = "generated"
kind = "checkpoint"
checkpoint = "model"
[[task]]
name = "real-or-generated"
design = "turing"
trials = 3
[[task]]
name = "preferred"
design = "preference"
trials = 2
"#;

/// Analysis of the study in the folder.
fn analysis(dir: &Path) -> Value {
    let mut orator = Command::new(env!("CARGO_BIN_EXE_orator"));
    let output =
        orator.current_dir(dir).args(["--json", "study", "analyse", "study", "--draws", "200"]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice::<Value>(&output.stdout).unwrap()["analysis"].take()
}

#[test]
fn the_analysis_finds_the_preference_of_scripted_participants() {
    let Some(driver) = browser_driver() else { return };
    if !Path::new("/usr/bin/chromium").exists() {
        return skip("no browser is installed (package chromium)");
    }
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    speaker(dir);
    fs::rename(dir.join("data"), dir.join("dataset")).unwrap();
    fs::rename(dir.join("models/host"), dir.join("model")).unwrap();
    fs::write(dir.join("study.toml"), STUDY).unwrap();
    let mut script = Command::new(Path::new(env!("CARGO_MANIFEST_DIR")).join(".ci/demo-study"));
    script.arg(dir).arg("3").env("ORATOR", env!("CARGO_BIN_EXE_orator")).env("ORATOR_DRIVER", driver);
    let output = script.env("CERTAINTY", "1").env("AT_ONCE", "3").output().unwrap();
    let [printed, errors] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text).into_owned());
    assert!(output.status.success(), "{printed}\n{errors}");
    assert!(printed.contains("the analysis finds the preference"), "{printed}");
    let page = fs::read_to_string(dir.join("analysis.html")).unwrap();
    assert!(page.contains("real-or-generated") && page.contains("Registered hypotheses"));

    // Sealed hypotheses count as registered, unless a sealed file was changed.
    let registered = analysis(dir);
    let seal: Value = serde_json::from_slice(&fs::read(dir.join("study/seal.json")).unwrap()).unwrap();
    assert_eq!(registered["seal"], seal["seal"]);
    let hypotheses = registered["hypotheses"].as_array().unwrap();
    assert_eq!(hypotheses.len(), 3, "{hypotheses:?}");
    assert!(hypotheses.iter().all(|hypothesis| !hypothesis["claims"].as_array().unwrap().is_empty()));
    let file = dir.join("study/study.toml");
    fs::write(&file, fs::read_to_string(&file).unwrap() + "\n").unwrap();
    let changed = analysis(dir);
    assert!(changed["seal"].is_null() && changed["hypotheses"].is_null(), "{changed}");
    assert!(changed["notes"][0].as_str().unwrap().contains("changed: study.toml"), "{}", changed["notes"]);
}
