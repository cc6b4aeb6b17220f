//! Different takes of one speech: a seed always gives the same bytes, another seed other motion; who has one take only says
//! so.

use crate::fixtures::clips;
use crate::fixtures::untrained::{generate, write_untrained_speaker};
use orator_formats::wav;
use orator_nn::weights::Contents;
use std::path::Path;

fn with_dropout(dir: &Path) {
    let file = dir.join("host.safetensors");
    write_untrained_speaker(&file);
    let mut contents = Contents::read(&file).unwrap();
    contents.facts["settings"]["dropout"] = 0.3.into();
    contents.write(&dir.join("varied.safetensors")).unwrap();
}

#[test]
fn a_seed_gives_its_take_and_variants_the_takes_of_the_seeds_that_follow() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    with_dropout(dir);
    let mut sound = clips::tone(16_000, 3.0, 220.0);
    sound.samples.iter_mut().enumerate().for_each(|(i, sample)| *sample *= ((i * 31) % 997) as f32 / 997.0);
    wav::write(&dir.join("speech.wav"), &sound).unwrap();
    let made = |args: &str| {
        let output = generate(dir, &format!("--checkpoint varied.safetensors --audio speech.wav {args}"));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let bytes = |name: &str| std::fs::read(dir.join(name)).unwrap();
    made("--out plain.npy");
    made("--seed 7 --out seven.npy");
    made("--seed 8 --out eight.npy");
    let said = made("--seed 7 --variants 3 --out take.npy take.bvh");
    assert!(said.contains("3 variants") && said.contains("take-3.bvh"), "{said}");
    assert_eq!(bytes("take-1.npy"), bytes("seven.npy"));
    assert_eq!(bytes("take-2.npy"), bytes("eight.npy"));
    let all = ["plain.npy", "take-1.npy", "take-2.npy", "take-3.npy"].map(bytes);
    assert!((1..all.len()).all(|n| !all[..n].contains(&all[n])), "two takes are alike");
    assert!(!dir.join("take.npy").exists());
}

#[test]
fn who_was_trained_without_dropout_has_one_take() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    with_dropout(dir);
    wav::write(&dir.join("speech.wav"), &clips::tone(16_000, 1.0, 220.0)).unwrap();
    let output = generate(dir, "--checkpoint host.safetensors --audio speech.wav --seed 1 --out a.bvh");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(1) && said.contains("without dropout"), "{said}");
    assert!(!dir.join("a.bvh").exists());
}
