//! A tool for people's videos sends nothing and writes nothing but what it was asked for, as the kernel sees it.

use crate::fixtures::skip::skip;
use crate::fixtures::support::Project;
use std::path::{Component, Path};
use std::process::{Command, Stdio};

/// System calls that reach a network or change a folder.
const CALLS: &str = "trace=socket,connect,sendto,openat,openat2,creat,mkdir,mkdirat,rename,renameat,renameat2,link,\
    linkat,symlink,symlinkat,unlink,unlinkat";

/// Runs a verb under strace and gives the calls that open a socket or write outside the project's folder.
fn calls_outside(project: &Project, args: &[&str]) -> Vec<String> {
    let home = project.dir().join("home");
    std::fs::create_dir_all(&home).unwrap();
    let trace = project.dir().join("trace.txt");
    let mut command = Command::new("strace");
    command.args(["-f", "-qq", "-y", "-e", CALLS, "-o"]).arg(&trace).arg(env!("CARGO_BIN_EXE_orator")).args(args);
    command.env("HOME", &home).env_remove("XDG_CACHE_HOME").current_dir(project.dir());
    let status = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status().unwrap();
    assert_eq!(status.code(), Some(0), "{args:?}");
    assert_eq!(std::fs::read_dir(&home).unwrap().count(), 0, "{args:?} wrote into the home folder");
    let trace = std::fs::read_to_string(trace).unwrap();
    let outside = trace.lines().filter(|line| is_outside(line, project.dir()));
    outside.map(str::to_owned).collect()
}

fn is_outside(line: &str, dir: &Path) -> bool {
    let call = line.trim_start_matches(|letter: char| letter.is_ascii_digit()).trim_start();
    if ["socket(", "connect(", "sendto("].iter().any(|name| call.starts_with(name)) {
        return true;
    }
    let reads = call.starts_with("open") && !["O_WRONLY", "O_RDWR", "O_CREAT"].iter().any(|flag| call.contains(flag));
    // The program's own working folder is the project's: a relative path without ".." stays in it.
    let mut paths = call.split('"').skip(1).step_by(2).map(Path::new);
    !reads && paths.any(|path| path != Path::new("/dev/null") && !is_beneath(path, dir))
}

fn is_beneath(path: &Path, dir: &Path) -> bool {
    (path.is_relative() || path.starts_with(dir)) && !path.components().any(|part| part == Component::ParentDir)
}

#[test]
fn no_verb_opens_a_socket_or_writes_outside_the_named_folders() {
    if Command::new("strace").arg("-V").output().is_err() {
        return skip("no strace");
    }
    let project = Project::with_clips("privacy", 1, 4.6);
    let verbs: [&[&str]; 8] = [
        &["init", "other"],
        &["models", "list"],
        &["models", "check", "person-marker"],
        &["doctor"],
        &["run"],
        &["status"],
        &["report"],
        &["dataset", "verify", "work/dataset/host"],
    ];
    for verb in verbs {
        let outside = calls_outside(&project, verb);
        assert!(outside.is_empty(), "{verb:?}:\n{}", outside.join("\n"));
    }
}
