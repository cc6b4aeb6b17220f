//! Real data and foreign programs that a test can do without: where they are absent the test skips loudly, and its
//! name with the reason becomes a line of `skipped-tests.txt` in the target folder.

use std::fs;
use std::io::Write as _;
use std::panic::Location;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Prints that the running test skips, and why; one line a test in the target folder's `skipped-tests.txt`.
#[track_caller]
pub fn skip(why: &str) {
    let thread = std::thread::current();
    // With one test thread all tests run in the main thread: the place in the source is their name then.
    let place = || format!("{}:{}", Location::caller().file(), Location::caller().line());
    let test = thread.name().filter(|name| *name != "main").map_or_else(place, str::to_owned);
    eprintln!("SKIPPED: {test}: {why}");
    let test_program = std::env::current_exe().unwrap();
    let file = test_program.ancestors().nth(3).unwrap().join("skipped-tests.txt");
    let known = fs::read_to_string(&file).unwrap_or_default();
    if !known.lines().any(|line| line.starts_with(&format!("{test}: "))) {
        let opened = fs::OpenOptions::new().create(true).append(true).open(&file);
        let line = format!("{test}: {}\n", why.replace('\n', " "));
        opened.and_then(|mut file| file.write_all(line.as_bytes())).unwrap();
    }
}

/// A file or folder of the real data, whose folder (with `data/`, `models/`, `reference/`) `ORATOR_DATA` names.
#[track_caller]
pub fn real_data(path: &str) -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("ORATOR_DATA").filter(|folder| !folder.is_empty()) else {
        skip("ORATOR_DATA names no folder of real data");
        return None;
    };
    let found = Path::new(&folder).join(path).canonicalize().ok();
    if found.is_none() {
        skip(&format!("{path} is not in {} (ORATOR_DATA)", folder.display()));
    }
    found
}

/// The folder that `variable` names, or `target/NAME`.
fn folder(variable: &str, name: &str) -> PathBuf {
    let here = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target").join(name);
    std::env::var_os(variable).map_or_else(here, PathBuf::from)
}

/// The folder of fetched models, if those that the defaults choose are there.
#[track_caller]
pub fn fetched_models() -> Option<PathBuf> {
    fetched_model("hand_landmark_lite_224.onnx")
}

/// The folder of fetched models, if this one is there.
#[track_caller]
pub fn fetched_model(file: &str) -> Option<PathBuf> {
    let folder = folder("ORATOR_MODELS", "models");
    let is_there = folder.join(file).is_file();
    if !is_there {
        skip(&format!("no {file} in {} (`make models`)", folder.display()));
    }
    is_there.then_some(folder)
}

/// The folder of the Python packages that read datasets and training logs, if `package` is in it.
#[track_caller]
pub fn readers(package: &str) -> Option<PathBuf> {
    let folder = folder("ORATOR_READERS", "readers");
    let is_there = folder.join(package).exists();
    if !is_there {
        skip(&format!("no Python package {package} in {} (`make readers`)", folder.display()));
    }
    is_there.then_some(folder)
}

/// The folder of the Python package that aligns words, if `python3` can import it.
#[track_caller]
pub fn aligner() -> Option<PathBuf> {
    let folder = folder("ORATOR_ALIGNER", "aligner");
    let mut ask = Command::new("python3");
    ask.args(["-c", "import pocketsphinx"]).env("PYTHONPATH", &folder).stderr(Stdio::null());
    let is_there = ask.status().is_ok_and(|status| status.success());
    if !is_there {
        skip(&format!("no Python package pocketsphinx in {} (`make aligner`)", folder.display()));
    }
    is_there.then_some(folder)
}

/// A Python 3.11 that can import Blender's module.
#[track_caller]
pub fn blender() -> Option<Command> {
    let folder = folder("ORATOR_BLENDER", "blender");
    let python = |name: &str| {
        let mut command = Command::new(name);
        command.env("PYTHONPATH", &folder).stdin(Stdio::null());
        command
    };
    let found = ["python3.11", "python3", "/usr/bin/python3"].into_iter().find(|name| {
        let ask = python(name).args(["-c", "import bpy"]).stdout(Stdio::null()).stderr(Stdio::null()).status();
        ask.is_ok_and(|status| status.success())
    });
    if found.is_none() {
        skip(&format!("no Python 3.11 with Blender's module in {} (`make blender`)", folder.display()));
    }
    found.map(python)
}

/// The Node module of the glTF validator.
#[track_caller]
pub fn gltf_validator() -> Option<PathBuf> {
    let module = folder("ORATOR_GLTF_VALIDATOR", "validator");
    let is_there = module.join("package.json").is_file() && Command::new("node").arg("--version").output().is_ok();
    if !is_there {
        skip(&format!("no node, or no glTF validator at {} (`make validator`)", module.display()));
    }
    is_there.then_some(module)
}

/// The folder whose `node_modules` hold three-vrm.
#[track_caller]
pub fn three_vrm() -> Option<PathBuf> {
    let folder = folder("ORATOR_VRM", "vrm");
    let module = folder.join("node_modules/@pixiv/three-vrm/package.json");
    let is_there = module.is_file() && Command::new("node").arg("--version").output().is_ok();
    if !is_there {
        skip(&format!("no node, or no three-vrm in {} (`make vrm`)", folder.display()));
    }
    is_there.then_some(folder)
}

/// The folder whose `node_modules` hold puppeteer-core and axe-core.
#[track_caller]
pub fn browser_driver() -> Option<PathBuf> {
    let folder = folder("ORATOR_DRIVER", "driver");
    let modules = ["puppeteer-core", "axe-core"].map(|name| folder.join("node_modules").join(name));
    let is_there =
        modules.iter().all(|module| module.is_dir()) && Command::new("node").arg("--version").output().is_ok();
    if !is_there {
        skip(&format!("no node, or no puppeteer-core and axe-core in {} (`make driver`)", folder.display()));
    }
    is_there.then_some(folder)
}

/// The Python of `ORATOR_REFERENCE_PYTHON`, else `python3`, if it can import `packages` (with commas between).
#[track_caller]
pub fn python(packages: &str) -> Option<String> {
    let python = std::env::var("ORATOR_REFERENCE_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let tried = Command::new(&python).args(["-c", &format!("import {packages}")]).output();
    let works = tried.is_ok_and(|output| output.status.success());
    if !works {
        skip(&format!("{python} cannot import {packages} (ORATOR_REFERENCE_PYTHON names another)"));
    }
    works.then_some(python)
}
