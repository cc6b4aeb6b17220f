//! Variants of the motion for one speech: a seed always gives the same bytes, another seed another motion; a speaker
//! trained without dropout has one variant.

use crate::fixtures::clips;
use crate::fixtures::models::untrained::{generate, write_untrained_speaker};
use orator_formats::wav;
use orator_nn::weights::Contents;
use std::path::Path;

fn write_speakers(dir: &Path) {
    let file = dir.join("host.safetensors");
    write_untrained_speaker(&file);
    let mut contents = Contents::read(&file).unwrap();
    contents.facts["settings"]["dropout"] = 0.3.into();
    contents.write(&dir.join("varied.safetensors")).unwrap();
}

#[test]
fn variants_are_the_motions_of_consecutive_seeds() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    write_speakers(dir);
    let mut sound = clips::tone(16_000, 3.0, 220.0);
    sound.samples.iter_mut().enumerate().for_each(|(i, sample)| *sample *= ((i * 31) % 997) as f32 / 997.0);
    wav::write(&dir.join("speech.wav"), &sound).unwrap();
    let run = |args: &str| {
        let output = generate(dir, &format!("--checkpoint varied.safetensors --audio speech.wav {args}"));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let bytes = |name: &str| std::fs::read(dir.join(name)).unwrap();
    run("--out plain.npy");
    run("--seed 7 --out seven.npy");
    run("--seed 8 --out eight.npy");
    let printed = run("--seed 7 --variants 3 --out take.npy take.bvh");
    assert!(printed.contains("3 variants") && printed.contains("take-3.bvh"), "{printed}");
    assert_eq!(bytes("take-1.npy"), bytes("seven.npy"));
    assert_eq!(bytes("take-2.npy"), bytes("eight.npy"));
    let all = ["plain.npy", "take-1.npy", "take-2.npy", "take-3.npy"].map(bytes);
    assert!((1..all.len()).all(|n| !all[..n].contains(&all[n])), "two variants are equal");
    assert!(!dir.join("take.npy").exists());
}

#[test]
fn a_speaker_trained_without_dropout_has_one_variant() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    write_speakers(dir);
    wav::write(&dir.join("speech.wav"), &clips::tone(16_000, 1.0, 220.0)).unwrap();
    let output = generate(dir, "--checkpoint host.safetensors --audio speech.wav --seed 1 --out a.bvh");
    let printed = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(1) && printed.contains("without dropout"), "{printed}");
    assert!(!dir.join("a.bvh").exists());
}
