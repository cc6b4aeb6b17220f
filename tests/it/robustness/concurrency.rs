//! Concurrent processes, and processes killed between any two renames: no data is lost and no forgotten data returns.

use crate::fixtures::figures::swinging;
use crate::fixtures::gesture_dataset::{FPS, sample};
use crate::fixtures::write_dataset::write_dataset;
use orator_base::stage::fingerprint::HashCache;
use orator_base::stage::progress::Silent;
use orator_dataset::verify::verify::verify;
use orator_dataset::{Dataset, Split};
use orator_formats::npy;
use orator_media::ffmpeg::probe;
use orator_test_support::project::{Project, files_under};
use orator_test_support::skip::skip;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

const CONFIG: &str = "[[speaker]]\nname = \"host\"\nvideos = [\"*.mp4\"]\n[gan]\nbatch = 2\nwindow_frames = 32\n\
    epoch_steps = 4\ncheckpoint_every = 3\n";
const FORGET: &str = "--json forget --speaker host --video a-00000000";

fn orator(dir: &Path, args: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    command.args(args.split_whitespace()).current_dir(dir).stdin(Stdio::null());
    command
}

fn finish(command: &mut Command) -> (i32, String) {
    let Output { status, stdout, stderr } = command.output().unwrap();
    let text = String::from_utf8_lossy(&stdout) + String::from_utf8_lossy(&stderr);
    (status.code().unwrap_or(-1), text.into_owned())
}

/// A work folder with a dataset of two videos.
fn project(dir: &Path) {
    std::fs::write(dir.join("pipeline.toml"), CONFIG).unwrap();
    let samples = [
        (Split::Train, sample("a-00000000-000000", 99, 0.0)),
        (Split::Train, sample("b-00000000-000000", 99, 1.0)),
        (Split::Validation, sample("c-00000000-000000", 64, 4.0)),
    ];
    write_dataset(&dir.join("work/dataset/host"), "host", FPS, &samples).unwrap();
}

fn bytes_under(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    files_under(folder).into_iter().map(|(name, path)| (name, std::fs::read(path).unwrap())).collect()
}

#[test]
fn forget_fails_while_a_training_uses_the_video() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    project(dir);
    let before = bytes_under(&dir.join("work/dataset/host"));
    let mut training =
        orator(dir, "train gan --steps 100000").stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let started = Instant::now();
    while !dir.join("work/gan/host/best.safetensors").exists() {
        assert!(started.elapsed() < Duration::from_secs(300) && training.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(20));
    }
    let (code, text) = finish(&mut orator(dir, FORGET));
    assert_eq!(code, 1, "{text}");
    let holder = format!("is in use by `orator train gan` (process {})", training.id());
    assert!(text.contains("nothing was removed") && text.contains(&holder), "{text}");
    assert!(bytes_under(&dir.join("work/dataset/host")) == before);
    // Other processes may generate with the latest checkpoint.
    orator_formats::wav::write(&dir.join("a.wav"), &sample("a-00000000-000000", 30, 0.0).sound).unwrap();
    let (code, text) = finish(&mut orator(dir, "generate --checkpoint work/gan/host --audio a.wav --out a.npy"));
    assert_eq!(code, 0, "{text}");
    training.kill().unwrap();
    training.wait().unwrap();
    let (code, text) = finish(&mut orator(dir, FORGET));
    assert!(code == 0 && text.contains("\"found\":[]"), "{text}");
    assert!(!dir.join("work/gan/host").exists() && verify(&dir.join("work/dataset/host"), true, &Silent).is_ok());
    assert_eq!(files_under(&dir.join("work")).iter().filter(|(name, _)| name.contains("a-00000000")).count(), 0);
}

#[test]
fn readers_block_writers_and_are_named_in_the_error() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    project(dir);
    let dataset = dir.join("work/dataset/host");
    let open = Dataset::open(&dataset).unwrap();
    for verb in [FORGET, "--json import work/dataset/host --speaker host --out work/dataset/host --force"] {
        let (code, text) = finish(&mut orator(dir, verb));
        let holder = format!("(process {}); wait", std::process::id());
        assert!(code == 1 && text.contains(&holder), "{verb}: {text}");
    }
    let (code, text) = finish(&mut orator(dir, "dataset verify work/dataset/host"));
    assert_eq!(code, 0, "readers share the lock: {text}");
    drop(open);
    assert_eq!(finish(&mut orator(dir, FORGET)).0, 0);
    assert!(Dataset::open(&dataset).is_ok());
    assert!(
        !files_under(dir).iter().any(|(name, _)| name.ends_with("host.lock")),
        "locks are removed with their processes"
    );
}

fn has_strace() -> bool {
    Command::new("strace").arg("-V").output().is_ok_and(|output| output.status.success())
}

/// Runs a verb under strace, which injects the faults `inject` into system calls; returns whether the verb succeeded.
fn injected(dir: &Path, inject: &[&str], verb: &str) -> bool {
    let mut command = Command::new("strace");
    command.args(["-f", "-qq", "-o", "/dev/null", "-e", "trace=rename,renameat,renameat2,fsync,unlink,unlinkat,rmdir"]);
    command.args(inject.iter().flat_map(|inject| ["-e", inject])).arg(env!("CARGO_BIN_EXE_orator"));
    command.args(verb.split_whitespace()).current_dir(dir);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status().unwrap().success()
}

#[test]
fn a_dataset_survives_kills_and_disk_errors_at_every_rename() {
    if !has_strace() {
        return skip("no strace");
    }
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let write = |name: &str, phase: f64| {
        write_dataset(&dir.join(name), "host", FPS, &[(Split::Train, sample("a-00000000-000000", 99, phase))]).unwrap();
    };
    write("new", 2.0);
    write("first", 0.0);
    let import = |source: &str| {
        let _ = std::fs::remove_dir_all(dir.join("out"));
        let (code, text) = finish(&mut orator(dir, &format!("import {source} --speaker host --out out")));
        assert_eq!(code, 0, "{text}");
        bytes_under(&dir.join("out"))
    };
    let import_with = |inject: &[&str]| injected(dir, inject, "import new --speaker host --out out --force");
    let (new, old) = (import("new"), import("first"));
    assert!(new != old && import_with(&[]) && bytes_under(&dir.join("out")) == new);
    let no_exchange = "inject=renameat2:error=EINVAL";
    for fault in ["signal=KILL", "error=EIO"] {
        for (more, call) in [(&[][..], "renameat2"), (&[no_exchange][..], "rename,renameat")] {
            let mut n_stopped = 0;
            for when in 1..10 {
                import("first");
                let stop = format!("inject={call}:{fault}:when={when}");
                let is_done = import_with(&[more, &[stop.as_str()]].concat());
                // The next command finds the old or the new dataset complete.
                let (code, text) = finish(&mut orator(dir, "dataset info out"));
                assert_eq!(code, 0, "{stop}: {text}");
                let now = bytes_under(&dir.join("out"));
                assert!(now == if is_done { new.clone() } else { old.clone() }, "{stop}: neither the old nor the new");
                assert!(import_with(more), "{stop}: the next import");
                assert!(bytes_under(&dir.join("out")) == new);
                let leftovers = files_under(dir).into_iter().filter(|(name, _)| name.starts_with(".out"));
                assert_eq!(leftovers.count(), 0, "{stop}: left over");
                if is_done {
                    break;
                }
                n_stopped += 1;
            }
            assert_eq!(n_stopped, 1 + more.len(), "{call}: renames of a replacement");
        }
    }
}

#[test]
fn a_forget_killed_at_any_removal_is_completed_by_the_next() {
    if !has_strace() {
        return skip("no strace");
    }
    for is_last in [false, true] {
        for when in 1.. {
            let folder = tempfile::tempdir().unwrap();
            let dir = folder.path();
            project(dir);
            if is_last {
                std::fs::remove_dir_all(dir.join("work/dataset/host")).unwrap();
                let samples = [(Split::Train, sample("a-00000000-000000", 99, 0.0))];
                write_dataset(&dir.join("work/dataset/host"), "host", FPS, &samples).unwrap();
            }
            let kill = format!("inject=unlink,unlinkat,rmdir:signal=KILL:when={when}");
            let is_done = injected(dir, &[&kill], FORGET);
            // If only the old dataset remained to be removed, the next forget finds no video and removes that dataset.
            finish(&mut orator(dir, FORGET));
            let contains_video = |bytes: &[u8]| bytes.windows(10).any(|window| window == b"a-00000000");
            for (name, bytes) in bytes_under(&dir.join("work")) {
                assert!(!contains_video(name.as_bytes()) && !contains_video(&bytes), "{kill}: {name}");
            }
            if is_done {
                assert!(when > 3, "killed at {when} calls");
                break;
            }
        }
    }
}

#[test]
fn a_late_disk_error_leaves_either_a_record_or_a_failure() {
    if !has_strace() {
        return skip("no strace");
    }
    let project = Project::with_clips("late", 1, 1.0);
    for when in 1..40 {
        let _ = std::fs::remove_dir_all(project.work());
        // The failing call is counted per thread; the first calls also include those of the hash cache.
        let fails = format!("inject=fsync:error=EIO:when={when}");
        let is_done = injected(project.dir(), &[&fails], "run --to extract");
        let files = files_under(&project.work().join("extract"));
        let n = |ending: &str| files.iter().filter(|(name, _)| name.ends_with(ending)).count();
        assert_eq!(n(".record.json") + n(".failed.json"), 1, "{fails}: {files:?}");
        if is_done && when > 4 {
            assert_eq!(n(".record.json"), 1);
            return;
        }
    }
    panic!("no run succeeded");
}

#[test]
fn concurrent_writes_of_the_hash_cache_succeed() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("hashes.json");
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                let hashes = HashCache::open(&file);
                (0..50).for_each(|_| hashes.save().unwrap());
            });
        }
    });
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
}

#[test]
fn concurrent_animations_to_one_file_leave_one_complete_video() {
    let dir = tempfile::tempdir().unwrap();
    npy::write(&dir.path().join("q.npy"), &swinging(4, 20)).unwrap();
    let start = || orator(dir.path(), "animate q.npy --out q.mp4").stderr(Stdio::piped()).spawn().unwrap();
    for child in [start(), start()] {
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    assert!(probe::probe(&dir.path().join("q.mp4")).is_ok());
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 2, "no attempt file remains");
}
