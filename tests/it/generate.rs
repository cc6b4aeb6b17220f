//! `orator generate` from the command line: what it is given wrong it says clearly, with exit code 1, and writes
//! nothing.

use crate::clips;
use orator::types::time::FrameRate;
use std::path::Path;
use std::process::{Command, Output};

fn generate(dir: &Path, args: &str) -> Output {
    let words = args.split_whitespace();
    Command::new(env!("CARGO_BIN_EXE_orator")).arg("generate").args(words).current_dir(dir).output().unwrap()
}

#[test]
fn wrong_input_is_named_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    orator::media::audio::write_wav(&dir.join("speech.wav"), &clips::tone(16_000, 0.5, 220.0)).unwrap();
    clips::write_numbered(dir, "silent.mp4", 4, FrameRate::new(15, 1), None);
    std::fs::write(dir.join("speaker.safetensors"), "no weights").unwrap();
    std::fs::write(dir.join("notes.mp3"), "no sound").unwrap();
    std::fs::write(dir.join("empty.wav"), "").unwrap();
    std::fs::create_dir(dir.join("nothing")).unwrap();

    let cases = [
        ("--checkpoint speaker.safetensors --audio speech.wav --out a.mov", ".npy (joints), .txt"),
        ("--checkpoint speaker.safetensors --audio speech.wav --out noending", "noending"),
        ("--checkpoint speaker.safetensors --audio speech.wav --out a.bvh --out a.bvh", "asked for twice"),
        ("--checkpoint speaker.safetensors --audio silent.mp4 --out silent.mp4", "speech itself"),
        ("--checkpoint speaker.safetensors --audio silent.mp4 --out a.bvh", "silent.mp4 has no sound track"),
        ("--checkpoint speaker.safetensors --audio gone.wav --out a.bvh", "gone.wav is not there"),
        ("--checkpoint speaker.safetensors --audio nothing --out a.bvh", "nothing is no file"),
        ("--checkpoint speaker.safetensors --audio notes.mp3 --out a.bvh", "notes.mp3"),
        ("--checkpoint speaker.safetensors --audio empty.wav --out a.bvh", "empty.wav"),
        ("--checkpoint gone.safetensors --audio speech.wav --out a.bvh", "gone.safetensors is not there"),
        ("--checkpoint nothing --audio speech.wav --out a.bvh", "nothing holds no checkpoint"),
        ("--checkpoint speaker.safetensors --audio speech.wav --out a.bvh", "speaker.safetensors"),
        ("--checkpoint speaker.safetensors --audio speech.wav", "--out"),
    ];
    for (args, expected) in cases {
        let output = generate(dir, args);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{args}: {said}");
        assert!(said.contains(expected), "{args}: {said}");
        assert!(!said.contains("panicked"), "{args}: {said}");
    }
    assert!(!dir.join("a.bvh").exists() && !dir.join("a.mov").exists());

    let output = generate(dir, "--json --checkpoint speaker.safetensors --audio gone.wav --out a.bvh");
    let said: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(said["error"].as_str().unwrap().contains("gone.wav"));
}
