//! The examples, run as functions on small generated files.

#![allow(dead_code)] // their `main`

use crate::fixtures::models::untrained::write_untrained_speaker;
use crate::fixtures::{clips, footage, gesture_dataset};
use orator_base::stage::Unit;
use orator_base::stage::artifacts::Artifact;
use orator_formats::wav;

#[path = "../../examples/generate_motion.rs"]
mod generate_motion;
#[path = "../../examples/lift_keypoints.rs"]
mod lift_keypoints;
#[path = "../../examples/read_dataset.rs"]
mod read_dataset;

#[test]
fn keypoints_are_lifted_to_an_animation() {
    let dir = tempfile::tempdir().unwrap();
    let unit = Unit { speaker: "host".into(), video: "a".into(), source: dir.path().join("a.mp4") };
    footage::write(dir.path(), &unit, &footage::good(40), "a");
    let out = dir.path().join("lifted.bvh");
    let line = lift_keypoints::lift(&Artifact::Keypoints.path(dir.path(), &unit), &out).unwrap();
    assert!(line.starts_with("40 frames at 15 fps"), "{line}");
    assert!(std::fs::read_to_string(out).unwrap().contains("Frames: 40"));
}

#[test]
fn speech_becomes_motion_and_unreadable_audio_is_a_typed_error() {
    let dir = tempfile::tempdir().unwrap();
    let [checkpoint, speech, out] = ["host.safetensors", "a.wav", "a.glb"].map(|name| dir.path().join(name));
    write_untrained_speaker(&checkpoint);
    wav::write(&speech, &clips::tone(16_000, 1.0, 220.0)).unwrap();
    let line = generate_motion::generate(&checkpoint, &speech, &out).unwrap();
    assert!(line.starts_with("1.0 s of speech") && out.is_file(), "{line}");
    let error = generate_motion::generate(&checkpoint, &checkpoint, &out).unwrap_err();
    assert!(error.is::<orator::UnreadableMedia>(), "{error:#}");
}

#[test]
fn a_dataset_is_read() {
    let dir = tempfile::tempdir().unwrap();
    gesture_dataset::dataset(dir.path());
    let lines = read_dataset::read(dir.path()).unwrap();
    assert!(lines[0].starts_with("train: 2 samples") && lines[1].contains("[99, 49, 3]"), "{lines:?}");
}
