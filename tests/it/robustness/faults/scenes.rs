//! The verbs that write, each in the smallest folder that it needs.

use super::shim::orator;
use crate::fixtures::clips::tone;
use crate::fixtures::figures::swinging;
use crate::fixtures::gesture_dataset::dataset;
use crate::fixtures::motion_folders::{folders, write_npy};
use crate::fixtures::support::files_under;
use crate::fixtures::untrained::write_untrained_speaker;
use orator::formats::wav;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

/// A verb, and what is there before it.
pub struct Scene {
    pub args: &'static [&'static str],
    /// What ran before.
    pub before: &'static [&'static [&'static str]],
}

const fn scene(args: &'static [&'static str], before: &'static [&'static [&'static str]]) -> Scene {
    Scene { args, before }
}

const RUN: &[&str] = &["run", "--jobs", "1"];
const IMPORT: &[&str] =
    &["import", "captured", "--no-sound", "--speaker", "other", "--out", "other", "--min-frames", "10"];
const TRAIN: &[&str] = &["train", "gan", "--dataset", "tones", "--out", "gan", "--set", "gan.batch=2", "--steps", "2"];
const BATCH: &[&str] =
    &["generate", "--checkpoint", "model/host.safetensors", "--audio-folder", "speech", "--out-folder", "moved"];

/// All of them; the first of a kind begins from nothing, the next over what is there.
pub const SCENES: [Scene; 22] = [
    scene(RUN, &[]),
    scene(&["run", "--jobs", "1", "--only", "dataset", "--force"], &[RUN]),
    scene(IMPORT, &[]),
    scene(
        &["import", "captured", "--no-sound", "--speaker", "other", "--out", "other", "--min-frames", "10", "--force"],
        &[IMPORT],
    ),
    scene(&["forget", "--video", "clip-1"], &[RUN]),
    scene(&["forget", "--speaker", "host"], &[RUN]),
    scene(TRAIN, &[]),
    scene(&["train", "gan", "--dataset", "tones", "--out", "gan", "--set", "gan.batch=2", "--steps", "4"], &[TRAIN]),
    scene(BATCH, &[]),
    scene(
        &[
            "generate",
            "--checkpoint",
            "model/host.safetensors",
            "--audio",
            "speech/1.wav",
            "--out",
            "m.npy",
            "m.bvh",
            "m.glb",
        ],
        &[],
    ),
    scene(&["generate", "--checkpoint", "model/host.safetensors", "--audio", "speech/1.wav", "--out", "m.mp4"], &[]),
    scene(&["animate", "motion.npy", "--out", "a.bvh", "a.glb", "a.npy"], &[]),
    scene(&["lift", "keypoints.npz", "--out", "joints.npy"], &[RUN]),
    scene(&["sheet"], &[RUN]),
    scene(&["report"], &[RUN]),
    scene(&["status"], &[RUN]),
    scene(&["evaluate", "--truth", "truth3d", "--prediction", "prediction", "--report", "page.html"], &[]),
    scene(&["init", "mine"], &[]),
    scene(&["models", "add", "models/marker_body.onnx", "--like", "body-marker", "--id", "own"], &[]),
    scene(&["demo", "draw", "drawn", "--videos", "1", "--secs", "1"], &[]),
    scene(&["man", "pages"], &[]),
    scene(&["dataset", "verify", "work/dataset/host"], &[RUN]),
];

/// The folders in which scenes begin, `fresh` and `ran`, in the folder `base`.
pub fn prepare(base: &Path) {
    let dir = &base.join("fresh");
    fs::create_dir_all(dir).unwrap();
    expect_success(dir, &["demo", "draw", ".", "--videos", "1", "--secs", "4.6"]);
    fs::create_dir_all(dir.join("model")).unwrap();
    write_untrained_speaker(&dir.join("model/host.safetensors"));
    write_npy(&dir.join("motion.npy"), &swinging(3, 20).joints);
    dataset(&dir.join("tones"));
    fs::create_dir_all(dir.join("speech")).unwrap();
    for at in 1..3 {
        wav::write(&dir.join(format!("speech/{at}.wav")), &tone(16_000, 2.0, 200.0 * f64::from(at))).unwrap();
    }
    folders(dir, &[5]);
    fs::rename(dir.join("truth"), dir.join("truth3d")).unwrap();
    expect_success(dir, &["animate", "motion.npy", "--fps", "30", "--out", "captured/take.bvh"]);
    copy(dir, &base.join("ran"));
    expect_success(&base.join("ran"), RUN);
}

/// What a scene needs before its verb, in the folder `dir`.
pub fn set_up(base: &Path, dir: &Path, scene: &Scene) {
    copy(&base.join(if scene.before == [RUN] { "ran" } else { "fresh" }), dir);
    scene.before.iter().filter(|args| **args != RUN).for_each(|args| expect_success(dir, args));
    if scene.args[0] == "lift" {
        let found = files_under(&dir.join("work/pose2d")).into_iter().find(|(name, _)| name.ends_with("keypoints.npz"));
        fs::copy(found.unwrap().1, dir.join("keypoints.npz")).unwrap();
    }
}

/// A copy of the folder `from` in the place of `to`, with the times of its files.
pub fn copy(from: &Path, to: &Path) {
    let _ = fs::remove_dir_all(to);
    assert!(Command::new("cp").arg("-a").args([from, to]).status().unwrap().success());
}

/// What is in the folder, by content, but for locks, attempts of killed programs (which go after a minute) and the
/// lines of records that say how much there was to do.
pub fn content(dir: &Path) -> BTreeMap<String, String> {
    let files =
        files_under(dir).into_iter().filter(|(name, _)| !name.ends_with(".lock") && !name.contains(".attempt-"));
    let hash = |name: &str, path: &Path| {
        let mut bytes = fs::read(path).unwrap();
        if name.ends_with("record.json") {
            let mut record: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
            ["line", "facts"].into_iter().for_each(|key| drop(record[key].take()));
            bytes = record.to_string().into_bytes();
        }
        blake3::hash(&bytes).to_hex()[..16].to_owned()
    };
    files.map(|(name, path)| (name.clone(), hash(&name, &path))).collect()
}

fn expect_success(dir: &Path, args: &[&str]) {
    let output = orator(dir, args).output().unwrap();
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
}
