//! `orator models` as a user meets it: list, fetch from a folder, check, add, and what goes wrong.

use crate::fixtures::onnx_models::models;
use std::path::Path;
use std::process::{Command, Output};

fn orator(dir: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    command.arg("models").args(arguments).arg("--models-dir").arg(dir).current_dir(dir.parent().unwrap());
    command.output().unwrap()
}

fn said(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

#[test]
fn fetch_check_and_add() {
    let Some((models, _)) = models() else { return };
    let root = tempfile::tempdir().unwrap();
    let dir = root.path().join("models");
    let mirror = models.to_str().unwrap();
    let fetched = orator(&dir, &["fetch", "hand-mediapipe-lite", "body-tinypose-128x96", "--mirror", mirror]);
    assert_eq!(fetched.status.code(), Some(0), "{}", said(&fetched));
    let checked = orator(&dir, &["check", "hand-mediapipe-lite", "body-tinypose-128x96"]);
    assert_eq!(checked.status.code(), Some(0), "{}", said(&checked));
    assert_eq!(orator(&dir, &["check"]).status.code(), Some(2));
    let listed = said(&orator(&dir, &["list"]));
    assert!(listed.contains("present") && listed.contains("missing") && listed.contains("Apache-2.0"), "{listed}");

    let own = root.path().join("own.onnx");
    std::fs::copy(models.join("body_pp_tinypose_256x192.onnx"), &own).unwrap();
    let own = own.to_str().unwrap();
    let unlike = orator(&dir, &["add", own, "--like", "body-tinypose-128x96"]);
    assert_eq!(unlike.status.code(), Some(1));
    assert!(
        said(&unlike).contains("[1, 3, 128, 96]") && said(&unlike).contains("[1, 3, 256, 192]"),
        "{}",
        said(&unlike)
    );
    let added = orator(&dir, &["add", own, "--like", "body-tinypose-256x192", "--id", "mine"]);
    assert_eq!(added.status.code(), Some(0), "{}", said(&added));
    assert_eq!(orator(&dir, &["check", "mine"]).status.code(), Some(0));
    assert_eq!(orator(&dir, &["add", own, "--like", "body-tinypose-256x192", "--id", "mine"]).status.code(), Some(1));

    std::fs::write(dir.join("own.onnx"), b"other bytes").unwrap();
    let wrong = orator(&dir, &["check", "mine"]);
    assert!(wrong.status.code() == Some(2) && said(&wrong).contains("sha256"), "{}", said(&wrong));
}

#[test]
fn what_cannot_be_had_says_how_it_was_made() {
    let root = tempfile::tempdir().unwrap();
    let output = orator(&root.path().join("models"), &["fetch", "hand-mediapipe-lite"]);
    assert_eq!(output.status.code(), Some(2));
    let said = said(&output);
    assert!(said.contains("tf2onnx") && said.contains("--mirror DIR") && said.contains("295dce8266e33faf"), "{said}");
    assert_eq!(orator(&root.path().join("models"), &["fetch", "nothing"]).status.code(), Some(1));
    let chosen = orator(&root.path().join("models"), &["list"]);
    assert_eq!(String::from_utf8_lossy(&chosen.stdout).lines().filter(|line| line.starts_with("* ")).count(), 4);
}
