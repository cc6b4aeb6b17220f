//! The frame rate is preserved from keypoints to an animation file, through every format in between.

use crate::fixtures::figures::swinging;
use crate::fixtures::keypoints::keypoints;
use ndarray::arr1;
use ndarray_npy::NpzWriter;
use orator_base::types::pose3d::Motion;
use orator_base::types::time::FrameRate;
use orator_formats::joints_description::path_of;
use orator_formats::mocap::captured::{self, MotionKind};
use orator_formats::mocap::motion_file;
use orator_formats::{authors_txt, joints_npz, npy};
use orator_lab::train::scene::body::{FilmedScene, Filming};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use std::fs::File;
use std::path::Path;
use std::process::Command;

const THIRTY: FrameRate = FrameRate::new(30, 1);

/// Exit code, JSON (with `--json`) and printed text.
fn orator(dir: &Path, args: &str) -> (i32, Value, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    let output = command.args(args.split_whitespace()).current_dir(dir).output().unwrap();
    let printed = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    (output.status.code().unwrap_or(-1), serde_json::from_slice(&output.stdout).unwrap_or_default(), printed)
}

fn done(dir: &Path, args: &str) -> Value {
    let (code, json, printed) = orator(dir, &format!("--json {args}"));
    assert_eq!(code, 0, "{args}: {printed}");
    json
}

fn frame_secs(bvh: &Path) -> f64 {
    let text = std::fs::read_to_string(bvh).unwrap();
    let line = text.lines().find(|line| line.starts_with("Frame Time:")).unwrap();
    line.rsplit(' ').next().unwrap().trim().parse().unwrap()
}

/// Writes keypoints of a synthetic speaker at 30 fps.
fn write_keypoints(path: &Path) {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let k = keypoints(&FilmedScene::from_rule(Filming::Clean, 45, &mut rng), &mut rng);
    let mut npz = NpzWriter::new(File::create(path).unwrap());
    npz.add_array("body", &k.body).unwrap();
    npz.add_array("left_hand", &k.left_hand).unwrap();
    npz.add_array("right_hand", &k.right_hand).unwrap();
    npz.add_array("fps", &arr1(&[30.0])).unwrap();
    npz.add_array("image_size", &arr1(&k.image_size.map(i64::from))).unwrap();
    npz.finish().unwrap();
}

#[test]
fn keypoints_at_30_fps_give_an_animation_at_30_fps() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    write_keypoints(&dir.join("k.npz"));
    for joints in ["j.npy", "j.npz", "j.txt"] {
        assert_eq!(done(dir, &format!("lift k.npz --out {joints}"))["fps"], json!({ "num": 30, "den": 1 }));
        let facts = done(dir, &format!("animate {joints} --out {joints}.bvh again-{joints}"));
        assert_eq!((&facts["fps_assumed"], &facts["fps"]["num"]), (&json!(false), &json!(30)), "{joints}");
        assert!((frame_secs(&dir.join(format!("{joints}.bvh"))) - 1.0 / 30.0).abs() < 1e-6, "{joints}");
        // The exported joints state their rate, too.
        let again = motion_file::read(&dir.join(format!("again-{joints}")), None).unwrap();
        assert!(again.motion.fps == THIRTY && again.has_rate && again.notes.is_empty(), "{joints}: {:?}", again.notes);
        let (code, _, printed) = orator(dir, &format!("animate {joints} --out x.bvh --input-fps 15"));
        assert!(code == 1 && printed.contains("has a frame rate of 30 fps"), "{joints}: {printed}");
        assert!(printed.contains(joints) && printed.contains("--input-fps"), "{joints}: {printed}");
        assert_eq!(done(dir, &format!("animate {joints} --out x.bvh --input-fps 30"))["fps_assumed"], false);
        std::fs::remove_file(dir.join("x.bvh")).unwrap();
    }
    let mask = joints_npz::read(&dir.join("j.npz")).unwrap();
    assert_eq!(mask.joints, npy::read(&dir.join("j.npy"), THIRTY).unwrap().joints);
    let described: Value = serde_json::from_slice(&std::fs::read(dir.join("j.npy.json")).unwrap()).unwrap();
    assert_eq!((&described["fps"], &described["shape"]), (&json!([30, 1]), &json!([45, 49, 3])));
    // `--input-fps` overrides the rate of the keypoints.
    assert_eq!(done(dir, "lift k.npz --input-fps 25 --out j.npz")["fps"]["num"], 25);
}

#[test]
fn an_assumed_frame_rate_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    npy::write(&dir.join("a.npy"), &swinging(1, 20)).unwrap();
    std::fs::write(dir.join("b.txt"), authors_txt::format(&swinging(1, 20))).unwrap();
    joints_npz::write(&dir.join("c.npz"), &swinging(2, 20)).unwrap();
    for bare in ["a.npy", "b.txt"] {
        let (_, _, printed) = orator(dir, &format!("animate {bare} --out a.bvh"));
        assert!(
            printed.contains("20 frames at 15 fps (assumed: not stated in the file; set it with --input-fps)"),
            "{printed}"
        );
        assert_eq!(done(dir, &format!("animate {bare} --out a.bvh"))["fps_assumed"], true);
        let (_, _, printed) = orator(dir, &format!("animate {bare} --out a.bvh --input-fps 30"));
        assert!(printed.contains("20 frames at 30 fps, 0.7 s"), "{printed}");
        let facts = done(dir, &format!("animate c.npz --out a.mp4 --compare {bare}"));
        assert!(facts["notes"].to_string().contains("does not state its frame rate: 15 fps is assumed"), "{facts}");
    }
    let (_, _, printed) = orator(dir, "animate c.npz --out a.bvh");
    assert!(!printed.contains("assumed"), "{printed}");
    // The path of a description is reserved, and a description that does not match its motion is rejected.
    let (code, _, printed) = orator(dir, "animate c.npz --out d.npy d.npy.json");
    assert!(code == 1 && printed.contains("d.npy.json is reserved for the frame rate of d.npy"), "{printed}");
    done(dir, "animate c.npz --out d.npy");
    npy::write(&dir.join("d.npy"), &swinging(1, 10)).unwrap();
    let (code, _, printed) = orator(dir, "animate d.npy --out a.bvh");
    assert!(code == 1 && printed.contains("d.npy.json describes 20 frames, but d.npy has 10"), "{printed}");
}

#[test]
fn motions_at_different_rates_are_compared_by_time() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let motion = swinging(1, 240);
    joints_npz::write(&dir.join("truth.npz"), &Motion { fps: THIRTY, ..motion.clone() }).unwrap();
    npy::write(&dir.join("made.npy"), &motion).unwrap();
    let args = "evaluate --truth truth.npz --prediction made.npy --convention speech2gesture";
    // 16 s against 8 s: the error suggests the frame rate.
    let (code, _, printed) = orator(dir, args);
    assert!(code == 1 && printed.contains("and the frame rates (--input-fps)"), "{printed}");
    std::fs::write(path_of(&dir.join("made.npy")), "{\"fps\": 30}").unwrap();
    let same = done(dir, args);
    assert!(!same["notes"].to_string().contains("has no frame rate"), "{}", same["notes"]);
    let noted = done(dir, &format!("{args} --input-fps 25"));
    assert!(
        noted["notes"].to_string().contains("made.npy has 30 fps: 25 fps (--input-fps) is ignored for this file"),
        "{}",
        noted["notes"]
    );
}

#[test]
fn units_and_orientation_of_captured_joints_are_checked() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("gt_interval_1.txt");
    let motion = swinging(1, 20);
    let read_scaled = |factor: f32| {
        let motion = Motion { joints: &motion.joints * factor, ..motion.clone() };
        std::fs::write(&path, authors_txt::format(&motion)).unwrap();
        captured::read(MotionKind::Authors, &path)
    };
    read_scaled(1.0).unwrap();
    for (factor, unit) in [(100.0, "centimetres; multiply every coordinate by 0.01"), (1000.0, "millimetres")] {
        let text = format!("{:#}", read_scaled(factor).unwrap_err());
        assert!(text.contains("gt_interval_1.txt") && text.contains(unit), "{text}");
    }
    let flipped = Motion { joints: motion.joints.mapv(|v| -v.abs()), ..motion };
    joints_npz::write(&path.with_extension("npz"), &flipped).unwrap();
    let notes = motion_file::read(&path.with_extension("npz"), None).unwrap().notes;
    assert!(notes.iter().any(|note| note.contains("so y seems to point up")), "{notes:?}");
}
