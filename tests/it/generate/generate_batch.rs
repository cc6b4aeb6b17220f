//! Several audio files in one call of `orator generate`: a failure does not stop the others, existing motions are not
//! generated again, and each motion depends on its own audio only.

use crate::fixtures::clips;
use crate::fixtures::models::untrained::{generate, write_untrained_speaker};
use orator_formats::wav;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// A folder with two valid audio files, an invalid one, and a speaker.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    std::fs::create_dir_all(dir.join("talks/sub")).unwrap();
    write_untrained_speaker(&dir.join("host.safetensors"));
    wav::write(&dir.join("talks/a.wav"), &clips::tone(16_000, 1.5, 220.0)).unwrap();
    wav::write(&dir.join("talks/sub/b.wav"), &clips::tone(8_000, 1.0, 330.0)).unwrap();
    std::fs::write(dir.join("talks/notes.mp3"), "no sound").unwrap();
    std::fs::write(dir.join("talks/read.me"), "no sound either").unwrap();
    folder
}

/// Counts of created, up-to-date and failed motions, and the complete answer.
fn run(dir: &Path, args: &str) -> ([u64; 3], Value) {
    let output = generate(dir, &format!("--json {args}"));
    let facts: Value = serde_json::from_slice(&output.stdout).unwrap();
    let counts = ["created", "up_to_date", "failed"].map(|key| facts[key].as_u64().unwrap_or(99));
    assert_eq!(output.status.code(), Some(if counts[2] > 0 { 2 } else { 0 }), "{facts}");
    (counts, facts)
}

#[test]
fn a_folder_is_generated_once_and_continues_after_an_invalid_file() {
    let folder = folder();
    let dir = folder.path();
    let args = "--checkpoint host.safetensors --audio-folder talks --out-folder made --format npy,bvh";
    let (counts, facts) = run(dir, args);
    assert_eq!(counts, [2, 0, 1]);
    let failed = facts["sounds"].as_array().unwrap().iter().find(|sound| sound["ended"] == "failed").unwrap();
    assert!(failed["error"].as_str().unwrap().contains("notes.mp3"), "{failed}");
    let telephone = facts["sounds"].as_array().unwrap().iter().find(|sound| sound["out"] == "sub/b").unwrap();
    assert!(telephone["note"].as_str().unwrap().contains("4000 Hz"), "{telephone}");
    assert!(generate(dir, "--checkpoint host.safetensors --audio talks/a.wav --out one.npy").status.success());
    let bytes = |file: &str| std::fs::read(dir.join(file)).unwrap();
    assert_eq!(bytes("one.npy"), bytes("made/a.npy"));
    assert_eq!(bytes("one.npy.json"), bytes("made/a.npy.json"));

    assert_eq!(run(dir, args).0, [0, 2, 1]);
    assert_eq!(run(dir, &format!("{args} --force")).0, [2, 0, 1]);
    std::fs::remove_file(dir.join("made/a.bvh")).unwrap();
    assert_eq!(run(dir, args).0, [1, 1, 1]);
    let before = bytes("made/sub/b.npy");
    wav::write(&dir.join("talks/sub/b.wav"), &clips::tone(16_000, 1.0, 500.0)).unwrap();
    assert_eq!(run(dir, args).0, [1, 1, 1]);
    assert_ne!(bytes("made/sub/b.npy"), before);
    assert_eq!(run(dir, &args.replace("npy,bvh", "txt")).0, [2, 0, 1]);
}

#[test]
fn a_table_names_its_motions_and_speakers() {
    let folder = folder();
    let dir = folder.path();
    let table = "audio,out,checkpoint\na.wav,first,../host.safetensors\nsub/b.wav,deep/second.npy,gone.safetensors\n\
                 sub/b.wav,third,\n";
    std::fs::write(dir.join("talks/list.csv"), table).unwrap();
    let args = "--batch talks/list.csv --out-folder made --format npy";
    let output = generate(dir, args);
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        output.status.code() == Some(1) && errors.contains("b.wav: add one to the table, or give --checkpoint"),
        "{errors}"
    );
    let (counts, facts) = run(dir, &format!("{args} --checkpoint host.safetensors"));
    assert_eq!(counts, [2, 0, 1], "{facts}");
    assert!(facts["sounds"][1]["error"].as_str().unwrap().contains("gone.safetensors"));
    assert!(dir.join("made/first.npy").is_file() && dir.join("made/third.npy").is_file());

    for (table, expected) in [
        ("audio,out\na.wav,x\nsub/b.wav,X\n", "would both be written to `X`"),
        ("audio,out\na.wav,../x\n", "line 2"),
        ("sound\na.wav\n", "unknown column `sound`"),
    ] {
        std::fs::write(dir.join("talks/list.csv"), table).unwrap();
        let output = generate(dir, &format!("{args} --checkpoint host.safetensors"));
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            output.status.code() == Some(1) && errors.contains("list.csv") && errors.contains(expected),
            "{errors}"
        );
    }
    for (args, expected) in [
        ("--audio-folder talks --out-folder made", "--checkpoint"),
        ("--checkpoint host.safetensors --audio-folder talks", "--out-folder"),
        ("--checkpoint host.safetensors --audio-folder talks --out-folder made --format mov", ".npy (joints)"),
        ("--checkpoint host.safetensors --audio-folder none --out-folder made", "none is not a folder"),
        ("--checkpoint host.safetensors", "--audio"),
    ] {
        let output = generate(dir, args);
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(1) && errors.contains(expected), "{args}: {errors}");
    }
}

#[test]
fn a_signal_ends_a_restricted_process() {
    let folder = folder();
    let dir = folder.path();
    for n in 0..500 {
        std::fs::copy(dir.join("talks/a.wav"), dir.join(format!("talks/{n}.wav"))).unwrap();
    }
    for (signal, code) in [(Signal::INT, 130), (Signal::TERM, 143)] {
        let out = format!("made-{code}");
        let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
        command.args(["generate", "--checkpoint", "host.safetensors", "--audio-folder", "talks", "--out-folder", &out]);
        let child = command.args(["--format", "npy"]).current_dir(dir).stderr(Stdio::piped()).spawn().unwrap();
        let n_motions = || std::fs::read_dir(dir.join(&out)).map_or(0, Iterator::count);
        while n_motions() == 0 {
            std::thread::sleep(Duration::from_millis(5));
        }
        kill_process(Pid::from_child(&child), signal).unwrap();
        let output = child.wait_with_output().unwrap();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(code) && errors.contains("stopped; completed"), "{errors}");
        assert!(n_motions() < 500);
    }
}
