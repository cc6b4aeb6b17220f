//! The frame rate on its way from keypoints to an animation file, in every kind of file between.

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

/// Exit code, JSON (of `--json`) and what was said.
fn orator(dir: &Path, args: &str) -> (i32, Value, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    let output = command.args(args.split_whitespace()).current_dir(dir).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    (output.status.code().unwrap_or(-1), serde_json::from_slice(&output.stdout).unwrap_or_default(), said)
}

fn done(dir: &Path, args: &str) -> Value {
    let (code, json, said) = orator(dir, &format!("--json {args}"));
    assert_eq!(code, 0, "{args}: {said}");
    json
}

fn frame_secs(bvh: &Path) -> f64 {
    let text = std::fs::read_to_string(bvh).unwrap();
    let line = text.lines().find(|line| line.starts_with("Frame Time:")).unwrap();
    line.rsplit(' ').next().unwrap().trim().parse().unwrap()
}

/// Keypoints of a talker at 30 frames a second.
fn talk(path: &Path) {
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
fn a_lift_at_30_frames_a_second_is_animated_at_30() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    talk(&dir.join("k.npz"));
    for joints in ["j.npy", "j.npz", "j.txt"] {
        assert_eq!(done(dir, &format!("lift k.npz --out {joints}"))["fps"], json!({ "num": 30, "den": 1 }));
        let facts = done(dir, &format!("animate {joints} --out {joints}.bvh again-{joints}"));
        assert_eq!((&facts["fps_assumed"], &facts["fps"]["num"]), (&json!(false), &json!(30)), "{joints}");
        assert!((frame_secs(&dir.join(format!("{joints}.bvh"))) - 1.0 / 30.0).abs() < 1e-6, "{joints}");
        // The figure's joints say their rate as well.
        let again = motion_file::read(&dir.join(format!("again-{joints}")), None).unwrap();
        assert!(again.motion.fps == THIRTY && again.has_rate && again.notes.is_empty(), "{joints}: {:?}", again.notes);
        let (code, _, said) = orator(dir, &format!("animate {joints} --out x.bvh --input-fps 15"));
        assert!(code == 1 && said.contains("says 30 fps, and 15 fps is given"), "{joints}: {said}");
        assert!(said.contains(joints) && said.contains("--input-fps"), "{joints}: {said}");
        assert_eq!(done(dir, &format!("animate {joints} --out x.bvh --input-fps 30"))["fps_assumed"], false);
        std::fs::remove_file(dir.join("x.bvh")).unwrap();
    }
    let mask = joints_npz::read(&dir.join("j.npz")).unwrap();
    assert_eq!(mask.joints, npy::read(&dir.join("j.npy"), THIRTY).unwrap().joints);
    let described: Value = serde_json::from_slice(&std::fs::read(dir.join("j.npy.json")).unwrap()).unwrap();
    assert_eq!((&described["fps"], &described["shape"]), (&json!([30, 1]), &json!([45, 49, 3])));
    // Given, the rate takes the place of the keypoints' own.
    assert_eq!(done(dir, "lift k.npz --input-fps 25 --out j.npz")["fps"]["num"], 25);
}

#[test]
fn an_assumed_rate_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    npy::write(&dir.join("a.npy"), &swinging(1, 20)).unwrap();
    std::fs::write(dir.join("b.txt"), authors_txt::format(&swinging(1, 20))).unwrap();
    joints_npz::write(&dir.join("c.npz"), &swinging(2, 20)).unwrap();
    for bare in ["a.npy", "b.txt"] {
        let (_, _, said) = orator(dir, &format!("animate {bare} --out a.bvh"));
        assert!(
            said.contains("20 frames at 15 fps (assumed: not stated in the file; set it with --input-fps)"),
            "{said}"
        );
        assert_eq!(done(dir, &format!("animate {bare} --out a.bvh"))["fps_assumed"], true);
        let (_, _, said) = orator(dir, &format!("animate {bare} --out a.bvh --input-fps 30"));
        assert!(said.contains("20 frames at 30 fps, 0.7 s"), "{said}");
        let facts = done(dir, &format!("animate c.npz --out a.mp4 --compare {bare}"));
        assert!(facts["notes"].to_string().contains("does not say its rate: taken for 15 fps"), "{facts}");
    }
    let (_, _, said) = orator(dir, "animate c.npz --out a.bvh");
    assert!(!said.contains("assumed"), "{said}");
    // What is written beside a name is not to be written over, and what is beside another motion is not believed.
    let (code, _, said) = orator(dir, "animate c.npz --out d.npy d.npy.json");
    assert!(code == 1 && said.contains("d.npy.json is reserved for the frame rate of d.npy"), "{said}");
    done(dir, "animate c.npz --out d.npy");
    npy::write(&dir.join("d.npy"), &swinging(1, 10)).unwrap();
    let (code, _, said) = orator(dir, "animate d.npy --out a.bvh");
    assert!(code == 1 && said.contains("d.npy.json describes 20 frames and d.npy has 10"), "{said}");
}

#[test]
fn what_is_of_another_rate_is_measured_beside_it_by_time() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let motion = swinging(1, 240);
    joints_npz::write(&dir.join("truth.npz"), &Motion { fps: THIRTY, ..motion.clone() }).unwrap();
    npy::write(&dir.join("made.npy"), &motion).unwrap();
    let args = "evaluate --truth truth.npz --prediction made.npy --convention speech2gesture";
    // 16 s beside 8: the rate is what is wrong.
    let (code, _, said) = orator(dir, args);
    assert!(code == 1 && said.contains("and the frame rates (--input-fps)"), "{said}");
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
fn units_of_captured_joints_are_found_out() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("gt_interval_1.txt");
    let motion = swinging(1, 20);
    let times = |by: f32| {
        let motion = Motion { joints: &motion.joints * by, ..motion.clone() };
        std::fs::write(&path, authors_txt::format(&motion)).unwrap();
        captured::read(MotionKind::Authors, &path)
    };
    times(1.0).unwrap();
    for (by, unit) in [(100.0, "centimetres; multiply every coordinate by 0.01"), (1000.0, "millimetres")] {
        let text = format!("{:#}", times(by).unwrap_err());
        assert!(text.contains("gt_interval_1.txt") && text.contains(unit), "{text}");
    }
    let turned = Motion { joints: motion.joints.mapv(|v| -v.abs()), ..motion };
    joints_npz::write(&path.with_extension("npz"), &turned).unwrap();
    let notes = motion_file::read(&path.with_extension("npz"), None).unwrap().notes;
    assert!(notes.iter().any(|note| note.contains("so y seems to point up")), "{notes:?}");
}
