//! `orator generate` from the command line with an untrained speaker: every kind of file, from every kind of sound;
//! and what it is given wrong it says clearly, with exit code 1, and writes nothing.

use crate::bvh::{Bvh, worst_mm};
use crate::clips;
use crate::figures::{FPS, swinging};
use ndarray::Axis;
use orator::animate::figure::bone_metres;
use orator::media::{audio, probe};
use orator::motion::{authors_txt, npy};
use orator::nn::params::Params;
use orator::nn::unet::{Config, Generator, Preset};
use orator::train::checkpoint::{self, Contents};
use orator::train::poses::{N_NUMBERS, Normalisation};
use orator::train::representation::Representation;
use orator::train::speaker::{Facts, GENERATOR};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output};

/// A checkpoint whose network knows nothing: it moves about the mean pose of a made-up motion.
fn write_untrained_speaker(file: &Path) {
    let motion = swinging(1, 40);
    let mean = motion.joints.mean_axis(Axis(0)).unwrap();
    let lengths: Vec<f32> = bone_metres(&motion)[1..].iter().map(|&metres| metres as f32).collect();
    let network = Config { width: 16, ..Config::of(Preset::Light, N_NUMBERS) };
    let mut params = Params::new(7);
    Generator::new(&mut params, &network).unwrap();
    let normal = Normalisation::new(&mean, &motion.joints.std_axis(Axis(0), 0.0), lengths);
    let facts = Facts::new("host", FPS, "", network, normal, Representation::Positions);
    let mut contents = Contents { facts: serde_json::json!({ "speaker": facts }), tensors: BTreeMap::new() };
    contents.add(GENERATOR, params.tensors().unwrap());
    contents.write(file).unwrap();
}

fn generate(dir: &Path, args: &str) -> Output {
    let words = args.split_whitespace();
    Command::new(env!("CARGO_BIN_EXE_orator")).arg("generate").args(words).current_dir(dir).output().unwrap()
}

#[test]
fn one_sound_becomes_every_kind_of_file() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    std::fs::create_dir(dir.join("training")).unwrap();
    write_untrained_speaker(&checkpoint::path(&dir.join("training"), 20));
    audio::write_wav(&dir.join("speech.wav"), &clips::tone(16_000, 2.05, 220.0)).unwrap();

    let outs = "--out made/a.npy made/a.txt --out made/a.bvh --out made/a.mp4";
    let output = generate(dir, &format!("--json --checkpoint training --audio speech.wav {outs}"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let facts: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((facts["n_frames"].as_u64(), facts["speaker"].as_str()), (Some(30), Some("host")));
    assert_eq!(facts["checkpoint"], "training/step-0000020.safetensors");
    assert_eq!(facts["outputs"].as_array().unwrap().len(), 4);

    let made = dir.join("made");
    let motion = npy::read(&made.join("a.npy"), FPS).unwrap();
    assert_eq!(authors_txt::read(&made.join("a.txt"), FPS).unwrap(), motion);
    let bvh = Bvh::parse(&std::fs::read_to_string(made.join("a.bvh")).unwrap());
    let worst = worst_mm(&motion, &bvh, |frame| bvh.places(frame));
    assert!(worst < 0.1, "{worst} mm");
    let film = probe::probe(&made.join("a.mp4")).unwrap();
    assert!((film.duration_secs.unwrap() - 2.05).abs() < 0.1);
    assert_eq!(std::fs::read_dir(&made).unwrap().count(), 4, "no attempt is left behind");

    // Another kind of sound: a telephone's mp3, a video's track.
    for command in ["-i speech.wav -ar 8000 phone.mp3", "-i made/a.mp4 -c copy talk.mov"] {
        if clips::ffmpeg(dir, command) {
            let sound = command.rsplit(' ').next().unwrap();
            let output = generate(dir, &format!("--checkpoint training --audio {sound} --out {sound}.bvh"));
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            assert!(String::from_utf8_lossy(&output.stdout).contains("next: orator generate --checkpoint training"));
            let n_frames = Bvh::parse(&std::fs::read_to_string(dir.join(format!("{sound}.bvh"))).unwrap()).frames.len();
            assert!((29..=32).contains(&n_frames), "{sound}: {n_frames} frames");
        }
    }
}

#[test]
fn wrong_input_is_named_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    write_untrained_speaker(&dir.join("host.safetensors"));
    audio::write_wav(&dir.join("speech.wav"), &clips::tone(16_000, 0.5, 220.0)).unwrap();
    audio::write_wav(&dir.join("click.wav"), &clips::tone(16_000, 0.03, 220.0)).unwrap();
    clips::write_numbered(dir, "silent.mp4", 4, FPS, None);
    std::fs::write(dir.join("broken.safetensors"), "no weights").unwrap();
    std::fs::write(dir.join("notes.mp3"), "no sound").unwrap();
    std::fs::write(dir.join("empty.wav"), "").unwrap();
    std::fs::create_dir(dir.join("nothing")).unwrap();

    let cases = [
        ("--checkpoint host.safetensors --audio speech.wav --out a.mov", ".npy (joints), .txt"),
        ("--checkpoint host.safetensors --audio speech.wav --out noending", "noending"),
        ("--checkpoint host.safetensors --audio speech.wav --out a.bvh --out a.bvh", "asked for twice"),
        ("--checkpoint host.safetensors --audio silent.mp4 --out silent.mp4", "speech itself"),
        ("--checkpoint host.safetensors --audio silent.mp4 --out a.bvh", "silent.mp4 has no sound track"),
        ("--checkpoint host.safetensors --audio gone.wav --out a.bvh", "gone.wav is not there"),
        ("--checkpoint host.safetensors --audio nothing --out a.bvh", "nothing is no file"),
        ("--checkpoint host.safetensors --audio notes.mp3 --out a.bvh", "notes.mp3"),
        ("--checkpoint host.safetensors --audio empty.wav --out a.bvh", "empty.wav"),
        ("--checkpoint host.safetensors --audio click.wav --out a.bvh", "too short"),
        (
            "--checkpoint host.safetensors --audio speech.wav --out speech.wav/a.bvh",
            "cannot make the folder speech.wav",
        ),
        ("--checkpoint gone.safetensors --audio speech.wav --out a.bvh", "gone.safetensors is not there"),
        ("--checkpoint nothing --audio speech.wav --out a.bvh", "nothing holds no checkpoint"),
        ("--checkpoint broken.safetensors --audio speech.wav --out a.bvh", "broken.safetensors"),
        ("--checkpoint host.safetensors --audio speech.wav", "--out"),
    ];
    for (args, expected) in cases {
        let output = generate(dir, args);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{args}: {said}");
        assert!(said.contains(expected), "{args}: {said}");
        assert!(!said.contains("panicked"), "{args}: {said}");
    }
    assert!(!dir.join("a.bvh").exists() && !dir.join("a.mov").exists());

    let output = generate(dir, "--json --checkpoint host.safetensors --audio gone.wav --out a.bvh");
    let said: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(said["error"].as_str().unwrap().contains("gone.wav"));
}
