//! Programs side by side, and killed between any two renames: nothing is lost, nothing forgotten comes back.

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

fn ended(command: &mut Command) -> (i32, String) {
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
fn a_video_is_not_forgotten_while_it_is_trained_on() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    project(dir);
    let before = bytes_under(&dir.join("work/dataset/host"));
    let mut training =
        orator(dir, "train gan --steps 100000").stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let begun = Instant::now();
    while !dir.join("work/gan/host/best.safetensors").exists() {
        assert!(begun.elapsed() < Duration::from_secs(300) && training.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(20));
    }
    let (code, said) = ended(&mut orator(dir, FORGET));
    assert_eq!(code, 1, "{said}");
    let who = format!("is in use by `orator train gan` (process {})", training.id());
    assert!(said.contains("nothing was removed") && said.contains(&who), "{said}");
    assert!(bytes_under(&dir.join("work/dataset/host")) == before);
    // Others may listen to what is learnt so far.
    orator_formats::wav::write(&dir.join("a.wav"), &sample("a-00000000-000000", 30, 0.0).sound).unwrap();
    let (code, said) = ended(&mut orator(dir, "generate --checkpoint work/gan/host --audio a.wav --out a.npy"));
    assert_eq!(code, 0, "{said}");
    training.kill().unwrap();
    training.wait().unwrap();
    let (code, said) = ended(&mut orator(dir, FORGET));
    assert!(code == 0 && said.contains("\"found\":[]"), "{said}");
    assert!(!dir.join("work/gan/host").exists() && verify(&dir.join("work/dataset/host"), true, &Silent).is_ok());
    assert_eq!(files_under(&dir.join("work")).iter().filter(|(name, _)| name.contains("a-00000000")).count(), 0);
}

#[test]
fn readers_keep_writers_away_and_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    project(dir);
    let dataset = dir.join("work/dataset/host");
    let open = Dataset::open(&dataset).unwrap();
    for verb in [FORGET, "--json import work/dataset/host --speaker host --out work/dataset/host --force"] {
        let (code, said) = ended(&mut orator(dir, verb));
        let who = format!("(process {}); wait", std::process::id());
        assert!(code == 1 && said.contains(&who), "{verb}: {said}");
    }
    let (code, said) = ended(&mut orator(dir, "dataset verify work/dataset/host"));
    assert_eq!(code, 0, "readers share: {said}");
    drop(open);
    assert_eq!(ended(&mut orator(dir, FORGET)).0, 0);
    assert!(Dataset::open(&dataset).is_ok());
    assert!(!files_under(dir).iter().any(|(name, _)| name.ends_with("host.lock")), "locks go with their programs");
}

fn has_strace() -> bool {
    Command::new("strace").arg("-V").output().is_ok_and(|output| output.status.success())
}

/// Runs a verb under strace, which does `inject` to system calls; whether it ended well.
fn injected(dir: &Path, inject: &[&str], verb: &str) -> bool {
    let mut command = Command::new("strace");
    command.args(["-f", "-qq", "-o", "/dev/null", "-e", "trace=rename,renameat,renameat2,fsync,unlink,unlinkat,rmdir"]);
    command.args(inject.iter().flat_map(|inject| ["-e", inject])).arg(env!("CARGO_BIN_EXE_orator"));
    command.args(verb.split_whitespace()).current_dir(dir);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status().unwrap().success()
}

#[test]
fn a_dataset_survives_a_kill_and_a_failing_disk_at_every_rename() {
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
        let (code, said) = ended(&mut orator(dir, &format!("import {source} --speaker host --out out")));
        assert_eq!(code, 0, "{said}");
        bytes_under(&dir.join("out"))
    };
    let import_with = |inject: &[&str]| injected(dir, inject, "import new --speaker host --out out --force");
    let (new, old) = (import("new"), import("first"));
    assert!(new != old && import_with(&[]) && bytes_under(&dir.join("out")) == new);
    let no_exchange = "inject=renameat2:error=EINVAL";
    for what in ["signal=KILL", "error=EIO"] {
        for (others, call) in [(&[][..], "renameat2"), (&[no_exchange][..], "rename,renameat")] {
            let mut n_stopped = 0;
            for when in 1..10 {
                import("first");
                let stop = format!("inject={call}:{what}:when={when}");
                let is_done = import_with(&[others, &[stop.as_str()]].concat());
                // What comes next finds one of them whole.
                let (code, said) = ended(&mut orator(dir, "dataset info out"));
                assert_eq!(code, 0, "{stop}: {said}");
                let now = bytes_under(&dir.join("out"));
                assert!(now == if is_done { new.clone() } else { old.clone() }, "{stop}: neither the old nor the new");
                assert!(import_with(others), "{stop}: the next import");
                assert!(bytes_under(&dir.join("out")) == new);
                let left = files_under(dir).into_iter().filter(|(name, _)| name.starts_with(".out"));
                assert_eq!(left.count(), 0, "{stop}: left over");
                if is_done {
                    break;
                }
                n_stopped += 1;
            }
            assert_eq!(n_stopped, 1 + others.len(), "{call}: renames of a replacement");
        }
    }
}

#[test]
fn a_forget_that_is_killed_at_any_removal_is_finished_by_the_next() {
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
            // Where only removing the old dataset was left, the next one no longer knows the video, and removes it.
            ended(&mut orator(dir, FORGET));
            let told = |bytes: &[u8]| bytes.windows(10).any(|window| window == b"a-00000000");
            for (name, bytes) in bytes_under(&dir.join("work")) {
                assert!(!told(name.as_bytes()) && !told(&bytes), "{kill}: {name}");
            }
            if is_done {
                assert!(when > 3, "killed at {when} places");
                break;
            }
        }
    }
}

#[test]
fn a_disk_that_fails_late_leaves_a_record_or_a_failure_and_never_both() {
    if !has_strace() {
        return skip("no strace");
    }
    let project = Project::with_clips("late", 1, 1.0);
    for when in 1..40 {
        let _ = std::fs::remove_dir_all(project.work());
        // The failing call is counted in each thread; the first of them belong to the table of hashes too.
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
    panic!("the disk fails for ever");
}

#[test]
fn a_table_of_hashes_that_two_programs_write_at_once_fails_neither() {
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
fn two_films_written_to_one_file_at_once_leave_one_whole_film() {
    let dir = tempfile::tempdir().unwrap();
    npy::write(&dir.path().join("q.npy"), &swinging(4, 20)).unwrap();
    let start = || orator(dir.path(), "animate q.npy --out q.mp4").stderr(Stdio::piped()).spawn().unwrap();
    for child in [start(), start()] {
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    assert!(probe::probe(&dir.path().join("q.mp4")).is_ok());
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 2, "no attempt is left");
}
