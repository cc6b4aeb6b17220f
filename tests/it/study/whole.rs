//! `make demo-study` in small: built, served, answered in Chromium by participants with a known preference, analysed.

use crate::fixtures::skip::{browser_driver, skip};
use crate::fixtures::study::films::speaker;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Short films, few of them: side by side, once by choice and once by preference.
const STUDY: &str = r#"
title = "Small"
participants = 3
spare = 0.0
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

#[test]
fn a_study_of_scripted_participants_finds_their_preference() {
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
    let [said, failed] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text).into_owned());
    assert!(output.status.success(), "{said}\n{failed}");
    assert!(said.contains("the analysis finds the preference"), "{said}");
    assert!(fs::read_to_string(dir.join("analysis.html")).unwrap().contains("real-or-generated"));
}
