//! Traces of system calls: no verb sends data or writes files that were not asked for. `orator study serve` is the only
//! verb that listens; it makes no connections.

use crate::fixtures::faults::scenes::{SCENES, copy, prepare, set_up};
use crate::fixtures::faults::shim::path_with;
use orator_test_support::skip::skip;
use std::path::{Component, Path};
use std::process::{Command, Stdio};

/// System calls that reach a network or change a folder.
const CALLS: &str = "trace=socket,connect,sendto,openat,openat2,creat,mkdir,mkdirat,rename,renameat,renameat2,link,\
    linkat,symlink,symlinkat,unlink,unlinkat";

/// Runs a verb under strace in `dir` and returns the calls that open a socket or write outside `dir`.
fn calls_outside(dir: &Path, args: &[&str]) -> Vec<String> {
    // Python runs in an empty temporary folder, which is removed afterwards.
    let [home, temporary] = ["home", "temporary"].map(|name| dir.join(name));
    [&home, &temporary].into_iter().for_each(|folder| std::fs::create_dir_all(folder).unwrap());
    let trace = dir.join("trace.txt");
    let mut command = Command::new("strace");
    command
        .args(["-f", "--seccomp-bpf", "-qq", "-y", "-e", CALLS, "-o"])
        .arg(&trace)
        .arg(env!("CARGO_BIN_EXE_orator"))
        .args(args);
    command.env("PATH", path_with(&dir.join("bin"))).env("TMPDIR", &temporary);
    command.env("HOME", &home).env_remove("XDG_CACHE_HOME").current_dir(dir);
    let status = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status().unwrap();
    assert_eq!(status.code(), Some(0), "{args:?}");
    for folder in [&home, &temporary] {
        let n_files = std::fs::read_dir(folder).unwrap().count();
        assert_eq!(n_files, 0, "{args:?} left files in {}", folder.display());
    }
    let trace = std::fs::read_to_string(trace).unwrap();
    let outside = trace.lines().filter(|line| is_outside(line, dir));
    outside.map(str::to_owned).collect()
}

fn is_outside(line: &str, dir: &Path) -> bool {
    let call = line.trim_start_matches(|letter: char| letter.is_ascii_digit()).trim_start();
    // The C library queries a local daemon for the user name, for a shell without SHELL or a Python that is a shell
    // script.
    if call.starts_with("socket(AF_UNIX") || call.contains("sun_path=\"/var/run/nscd/socket\"") {
        return false;
    }
    if ["socket(", "connect(", "sendto("].iter().any(|name| call.starts_with(name)) {
        return true;
    }
    let reads = call.starts_with("open") && !["O_WRONLY", "O_RDWR", "O_CREAT"].iter().any(|flag| call.contains(flag));
    // The working directory is that of the project: a relative path without ".." stays in it.
    let mut paths = call.split('"').skip(1).step_by(2).map(Path::new);
    // A Python that is a shell script opens the terminal.
    let is_device = |path: &Path| [Path::new("/dev/null"), Path::new("/dev/tty")].contains(&path);
    !reads && paths.any(|path| !is_device(path) && !is_beneath(path, dir))
}

fn is_beneath(path: &Path, dir: &Path) -> bool {
    (path.is_relative() || path.starts_with(dir)) && !path.components().any(|part| part == Component::ParentDir)
}

#[test]
fn no_verb_opens_a_socket_or_writes_outside_the_named_folders() {
    if Command::new("strace").arg("-V").output().is_err() {
        return skip("no strace");
    }
    let folder = tempfile::Builder::new().prefix("orator-privacy-").tempdir().unwrap();
    let root = folder.path().canonicalize().unwrap();
    prepare(&root);
    let (ran, scratch) = (root.join("ran"), root.join("place"));
    let scene_calls = SCENES.iter().filter(|scene| scene.args[0] != "orator-lab").map(|scene| {
        set_up(&root, &scratch, scene);
        (scene.args, calls_outside(&scratch, scene.args))
    });
    let other_verbs: [&[&str]; 6] = [
        &["models", "list"],
        &["models", "check", "body-marker"],
        &["doctor"],
        &["dataset", "info", "work/dataset/host"],
        &["guide", "models"],
        &["completions", "bash"],
    ];
    let other_calls = other_verbs.into_iter().map(|args| {
        copy(&ran, &scratch);
        (args, calls_outside(&scratch, args))
    });
    for (args, outside) in scene_calls.chain(other_calls) {
        assert!(outside.is_empty(), "{args:?}:\n{}", outside.join("\n"));
    }
}
