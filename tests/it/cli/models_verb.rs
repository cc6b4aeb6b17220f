//! `orator models` as a user meets it: list, fetch from a folder, check, add, and what goes wrong.

use crate::fixtures::onnx_models::models;
use crate::fixtures::source_models::packages::{package_models, stand_in};
use orator_test_support::skip::real_data;
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
    let Some((store, _)) = models() else { return };
    let root = tempfile::tempdir().unwrap();
    let dir = root.path().join("models");
    let mirror = store.dir().to_str().unwrap();
    let fetched = orator(&dir, &["fetch", "hand-mediapipe-lite", "palm-mediapipe-full", "--mirror", mirror]);
    assert_eq!(fetched.status.code(), Some(0), "{}", said(&fetched));
    assert!(said(&fetched).contains("licence Apache-2.0"), "{}", said(&fetched));
    let beside = std::fs::read_to_string(dir.join("hand_landmark_lite_224.licence.txt")).unwrap();
    assert!(beside.contains("google-ai-edge/mediapipe") && beside.contains("Apache-2.0"), "{beside}");
    let checked = orator(&dir, &["check", "hand-mediapipe-lite", "palm-mediapipe-full"]);
    assert_eq!(checked.status.code(), Some(0), "{}", said(&checked));
    assert_eq!(orator(&dir, &["check"]).status.code(), Some(2));
    let listed = said(&orator(&dir, &["list"]));
    assert!(listed.contains("present") && listed.contains("missing") && listed.contains("Apache-2.0"), "{listed}");

    let own = root.path().join("own.onnx");
    std::fs::copy(store.dir().join("hand_landmark_lite_224.onnx"), &own).unwrap();
    let own = own.to_str().unwrap();
    let unlike = orator(&dir, &["add", own, "--like", "palm-mediapipe-full"]);
    assert_eq!(unlike.status.code(), Some(1));
    assert!(
        said(&unlike).contains("[1, 192, 192, 3]") && said(&unlike).contains("[1, 224, 224, 3]"),
        "{}",
        said(&unlike)
    );
    let added = orator(&dir, &["add", own, "--like", "hand-mediapipe-lite", "--id", "mine"]);
    assert_eq!(added.status.code(), Some(0), "{}", said(&added));
    assert_eq!(orator(&dir, &["check", "mine"]).status.code(), Some(0));
    assert_eq!(orator(&dir, &["add", own, "--like", "hand-mediapipe-lite", "--id", "mine"]).status.code(), Some(1));

    std::fs::write(dir.join("own.onnx"), b"other bytes").unwrap();
    let wrong = orator(&dir, &["check", "mine"]);
    assert!(wrong.status.code() == Some(2) && said(&wrong).contains("sha256"), "{}", said(&wrong));
}

#[test]
fn what_cannot_be_had_says_how_it_was_made() {
    let root = tempfile::tempdir().unwrap();
    let output = orator(&root.path().join("models"), &["fetch", "body-tinypose-128x96"]);
    assert_eq!(output.status.code(), Some(2));
    let said = said(&output);
    assert!(
        said.contains("own converter") && said.contains("--mirror DIR") && said.contains("a5941b308814169f"),
        "{said}"
    );
    assert_eq!(orator(&root.path().join("models"), &["fetch", "nothing"]).status.code(), Some(1));
    let chosen = orator(&root.path().join("models"), &["list"]);
    assert_eq!(String::from_utf8_lossy(&chosen.stdout).lines().filter(|line| line.starts_with("* ")).count(), 4);
}

#[test]
fn a_mirror_of_what_a_model_is_made_of_will_do() {
    let (Some(origin), Some((store, _))) = (real_data("models/origin"), models()) else { return };
    let root = tempfile::tempdir().unwrap();
    let dir = root.path().join("models");
    let output = orator(&dir, &["fetch", "body-tinypose-256x192", "--mirror", origin.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    assert!(said(&output).contains("files of the mirror"), "{}", said(&output));
    let read = |dir: &Path| std::fs::read(dir.join("body_tinypose_256x192.onnx")).unwrap();
    assert!(read(&dir) == read(store.dir()), "one model, one result");
}

#[test]
fn the_first_source_that_answers_is_taken() {
    let root = tempfile::tempdir().unwrap();
    let (dir, bin) = (root.path().join("models"), root.path().join("bin"));
    for folder in [&dir, &bin] {
        std::fs::create_dir(folder).unwrap();
    }
    let fetch = |order: &[&str]| {
        std::fs::write(dir.join("manifest.toml"), package_models(root.path(), order)).unwrap();
        let _ = std::fs::remove_file(dir.join("packed_person.onnx"));
        let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
        command.args(["models", "fetch", "person-packed", "--models-dir"]).arg(&dir);
        let path = format!("{}:/usr/bin:/bin", bin.display());
        command.env("PATH", if order.len() == 3 { bin.to_str().unwrap().to_owned() } else { path }).output().unwrap()
    };
    let none = fetch(&["address", "npm", "pip"]);
    let message = said(&none);
    assert_eq!(none.status.code(), Some(2), "{message}");
    let reasons = ["127.0.0.1", "npm is not installed (Debian package npm)", "Debian package python3-pip"];
    assert!(reasons.iter().all(|reason| message.contains(reason)), "{message}");

    for (from, file) in [("npm", "host-1.tgz"), ("pip", "host-1.whl")] {
        stand_in(&bin, if from == "npm" { "npm" } else { "pip3" }, root.path().join(file).to_str().unwrap());
        let had = fetch(&["address", from]);
        assert_eq!(had.status.code(), Some(0), "{}", said(&had));
        assert!(said(&had).contains(if from == "npm" { "npm package host@1" } else { "PyPI package host==1" }));
        let licence = std::fs::read_to_string(dir.join("packed_person.licence.txt")).unwrap();
        assert!(licence.contains("as you like") && licence.contains("licence MIT"), "{licence}");
        assert!(!dir.join(".downloads").exists());
    }
    std::fs::write(root.path().join("host-1.tgz"), b"another package").unwrap();
    std::fs::remove_file(dir.join("packed_person.onnx")).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    command.args(["models", "fetch", "person-packed", "--models-dir"]).arg(&dir);
    let wrong = command.env("PATH", format!("{}:/usr/bin:/bin", bin.display())).output().unwrap();
    assert!(wrong.status.code() == Some(0), "the wheel is still right: {}", said(&wrong));
}
