//! Optional real data and external programs: if they are absent, the test prints that it is skipped and appends its
//! name and the reason to `skipped-tests.txt` in the target folder.

use std::fs;
use std::io::Write as _;
use std::panic::Location;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Reports that the running test is skipped, and why; appends one line per test to `skipped-tests.txt` in the target
/// folder.
#[track_caller]
pub fn skip(why: &str) {
    let thread = std::thread::current();
    // With one test thread all tests run in the main thread, so the source location replaces the name.
    let location = || format!("{}:{}", Location::caller().file(), Location::caller().line());
    let test = thread.name().filter(|name| *name != "main").map_or_else(location, str::to_owned);
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

/// Path within the real data, the folder named by `ORATOR_DATA` (with `data/`, `models/`, `reference/`).
#[track_caller]
pub fn real_data(path: &str) -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("ORATOR_DATA").filter(|folder| !folder.is_empty()) else {
        skip("ORATOR_DATA is not set to a folder of real data");
        return None;
    };
    let found = Path::new(&folder).join(path).canonicalize().ok();
    if found.is_none() {
        skip(&format!("{path} is not in {} (ORATOR_DATA)", folder.display()));
    }
    found
}

/// Folder named by the environment variable `variable`, or `target/NAME`.
fn folder(variable: &str, name: &str) -> PathBuf {
    let default_folder = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target").join(name);
    std::env::var_os(variable).map_or_else(default_folder, PathBuf::from)
}

/// Folder of downloaded models, if it contains those that the defaults choose.
#[track_caller]
pub fn fetched_models() -> Option<PathBuf> {
    fetched_model("hand_landmark_lite_224.onnx")
}

/// Folder of downloaded models, if it contains `file`.
#[track_caller]
pub fn fetched_model(file: &str) -> Option<PathBuf> {
    let folder = folder("ORATOR_MODELS", "models");
    let is_installed = folder.join(file).is_file();
    if !is_installed {
        skip(&format!("no {file} in {} (`make models`)", folder.display()));
    }
    is_installed.then_some(folder)
}

/// Folder of the Python packages that read datasets and training logs, if it contains `package`.
#[track_caller]
pub fn readers(package: &str) -> Option<PathBuf> {
    let folder = folder("ORATOR_READERS", "readers");
    let is_installed = folder.join(package).exists();
    if !is_installed {
        skip(&format!("no Python package {package} in {} (`make readers`)", folder.display()));
    }
    is_installed.then_some(folder)
}

/// Folder of the Python package for word alignment, if `python3` can import it.
#[track_caller]
pub fn aligner() -> Option<PathBuf> {
    let folder = folder("ORATOR_ALIGNER", "aligner");
    let mut ask = Command::new("python3");
    ask.args(["-c", "import pocketsphinx"]).env("PYTHONPATH", &folder).stderr(Stdio::null());
    let is_installed = ask.status().is_ok_and(|status| status.success());
    if !is_installed {
        skip(&format!("no Python package pocketsphinx in {} (`make aligner`)", folder.display()));
    }
    is_installed.then_some(folder)
}

/// Command of a Python 3.11 that can import Blender's module.
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
        skip(&format!("no Python 3.11 with the module bpy in {} (`make blender`)", folder.display()));
    }
    found.map(python)
}

/// Node module of the glTF validator.
#[track_caller]
pub fn gltf_validator() -> Option<PathBuf> {
    let module = folder("ORATOR_GLTF_VALIDATOR", "validator");
    let is_installed = module.join("package.json").is_file() && Command::new("node").arg("--version").output().is_ok();
    if !is_installed {
        skip(&format!("no node, or no glTF validator at {} (`make validator`)", module.display()));
    }
    is_installed.then_some(module)
}

/// Folder whose `node_modules` contain three-vrm.
#[track_caller]
pub fn three_vrm() -> Option<PathBuf> {
    let folder = folder("ORATOR_VRM", "vrm");
    let module = folder.join("node_modules/@pixiv/three-vrm/package.json");
    let is_installed = module.is_file() && Command::new("node").arg("--version").output().is_ok();
    if !is_installed {
        skip(&format!("no node, or no three-vrm in {} (`make vrm`)", folder.display()));
    }
    is_installed.then_some(folder)
}

/// Folder whose `node_modules` contain ONNX Runtime for browsers.
#[track_caller]
pub fn onnx_web() -> Option<PathBuf> {
    let folder = folder("ORATOR_WEB", "web");
    let is_installed = folder.join("node_modules/onnxruntime-web/package.json").is_file();
    if !is_installed {
        skip(&format!("no onnxruntime-web in {} (`make web`)", folder.display()));
    }
    is_installed.then_some(folder)
}

/// Folder whose `node_modules` contain puppeteer-core and axe-core.
#[track_caller]
pub fn browser_driver() -> Option<PathBuf> {
    let folder = folder("ORATOR_DRIVER", "driver");
    let modules = ["puppeteer-core", "axe-core"].map(|name| folder.join("node_modules").join(name));
    let is_installed =
        modules.iter().all(|module| module.is_dir()) && Command::new("node").arg("--version").output().is_ok();
    if !is_installed {
        skip(&format!("no node, or no puppeteer-core and axe-core in {} (`make driver`)", folder.display()));
    }
    is_installed.then_some(folder)
}

/// Python interpreter of `ORATOR_REFERENCE_PYTHON`, else `python3`, if it can import `packages` (comma-separated).
#[track_caller]
pub fn python(packages: &str) -> Option<String> {
    let python = std::env::var("ORATOR_REFERENCE_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let tried = Command::new(&python).args(["-c", &format!("import {packages}")]).output();
    let works = tried.is_ok_and(|output| output.status.success());
    if !works {
        skip(&format!("{python} cannot import {packages} (set ORATOR_REFERENCE_PYTHON to use another interpreter)"));
    }
    works.then_some(python)
}
