//! An invalid keypoint file is an error that states the file, the location and what was expected.

use crate::fixtures::media::foreign_keypoints as foreign;
use crate::fixtures::media::foreign_keypoints::OpenPoseOrder;
use ndarray::{Array2, Array3};
use ndarray_npy::write_npy;
use orator_base::types::time::FrameRate;
use orator_formats::keypoints::read;
use serde_json::json;
use std::path::Path;
use std::process::Command;

const RATE: FrameRate = FrameRate::new(15, 1);

/// The error message, or the notes, without the path of the folder.
fn message(dir: &Path, name: &str) -> String {
    let path = dir.join(name);
    let text = match read(&path) {
        Ok(found) => format!("read: {:?}", found.notes),
        Err(error) => format!("{error:#}"),
    };
    text.replace(&format!("{}/", dir.display()), "")
}

fn write_into(dir: &Path, name: &str, text: &str) {
    let path = dir.join(name);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, text).unwrap();
}

#[test]
fn every_kind_of_invalid_file_has_its_own_message() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| write_into(dir.path(), name, text);
    let person = |n: usize| json!({ "image_id": "0.jpg", "keypoints": vec![5.0; n], "score": 1.0 });
    write("empty.json", "");
    write("text.json", "keypoints follow");
    write("cut.json", "[{\"image_id\": \"0.jpg\", \"keypoints\": [1, 2,");
    write("string.json", "[{\"image_id\": \"0.jpg\", \"keypoints\": \"none\"}]");
    write("other.json", "{\"bodies\": []}");
    write("nothing.json", "[]");
    write("count.json", &json!([person(57)]).to_string());
    write("uneven.json", &json!([person(50)]).to_string());
    write("nameless.json", "[{\"image_id\": \"first.jpg\", \"keypoints\": []}]");
    write("half.json", "[{\"image_id\": 0, \"keypoints\": []}, {\"keypoints\": []}]");
    write("twice.json", "[{\"frame_id\": 3, \"instances\": []}, {\"frame_id\": 3, \"instances\": []}]");
    write(
        "three.json",
        &json!([{ "frame_id": 0, "instances": [{ "keypoints": vec![[1.0; 3]; 17], "keypoint_scores": vec![0.5; 17] }] }])
            .to_string(),
    );
    write("picture.json", "{\"images\": [], \"annotations\": [{\"keypoints\": []}]}");
    write(
        "unknown.json",
        "{\"images\": [{\"id\": 1, \"file_name\": \"1.jpg\"}], \"annotations\": [{\"image_id\": 2}]}",
    );
    write("sparse.json", "[{\"image_id\": 397133, \"keypoints\": []}, {\"image_id\": 900, \"keypoints\": []}]");
    write("crowd.json", &serde_json::Value::from(vec![person(51); 1001]).to_string());
    write("nobody/a_0_keypoints.json", "{\"people\": []}");
    write("mixed/a_0_keypoints.json", "{\"people\": []}");
    write("mixed/b_0_keypoints.json", "{\"people\": []}");
    write("many/talk1.json", "[{\"frame_id\": 0, \"instances\": []}, {\"frame_id\": 1, \"instances\": []}]");
    write("unnumbered/first.json", "{\"people\": []}");
    write(
        "hands/a_0_keypoints.json",
        &json!({ "people": [{ "pose_keypoints_2d": vec![5.0; 75], "hand_left_keypoints_2d": [1, 2, 1] }] }).to_string(),
    );
    std::fs::create_dir(dir.path().join("void")).unwrap();
    write("set.h5", "\u{89}HDF");
    std::fs::write(dir.path().join("set.h5"), b"\x89HDF\r\n").unwrap();
    write("list.npy", "\u{93}NUM");
    std::fs::write(dir.path().join("list.npy"), b"\x93NUMPY\x01\x00").unwrap();
    write_npy(dir.path().join("shape.npy"), &Array3::<f32>::ones((4, 49, 3))).unwrap();
    write_npy(dir.path().join("missing.npy"), &Array2::<f32>::from_elem((4, 104), f32::NAN)).unwrap();
    let mut signed = Array3::<f32>::zeros((4, 33, 4));
    for ((_, j, k), value) in signed.indexed_iter_mut() {
        *value = if k < 2 { 0.5 - 0.1 * j as f32 } else { 1.0 };
    }
    write_npy(dir.path().join("signed.npy"), &signed).unwrap();
    for (name, expected) in [
        ("empty.json", "empty.json has no readable keypoints: not JSON: expected { or [ at the start"),
        ("text.json", "text.json has no readable keypoints: not JSON: expected { or [ at the start"),
        (
            "cut.json",
            "cut.json has no readable keypoints: the JSON is truncated, damaged or of another format: EOF while \
             parsing a",
        ),
        ("string.json", "invalid type: string \"none\", expected numbers or lists of numbers at line 1 column"),
        ("other.json", "other.json has no readable keypoints: expected `people` (OpenPose)"),
        ("nothing.json", "nothing.json: no person is visible in any frame"),
        (
            "count.json",
            "count.json has no readable keypoints: frame 0, person 0: 19 points per person: expected one of 17, 18, 25, \
             26, 133, 136",
        ),
        ("uneven.json", "frame 0, person 0: `keypoints` has 50 numbers, expected x, y and score for each point"),
        ("nameless.json", "image_id \"first.jpg\" has no digits: expected the frame number in it"),
        ("half.json", "person 1 of the list: the key image_id is missing"),
        ("twice.json", "duplicate frame_id 3: expected the frames of one video"),
        (
            "three.json",
            "frame 0, person 0: `keypoints` has 51 numbers for 17 scores, expected x and y for each score (2D)",
        ),
        ("picture.json", "annotation 0: the key image_id is missing"),
        ("unknown.json", "annotation 0: `images` has no image 2"),
        ("sparse.json", "2 frames numbered from 900 to 397133: expected consecutive frames of one video"),
        ("crowd.json", "frame 0 has 1001 persons, expected at most 1000"),
        ("nobody", "nobody: no person is visible in any frame"),
        (
            "mixed",
            "mixed/a_0_keypoints.json and mixed/b_0_keypoints.json are both frame 0; use a separate folder for each \
             video",
        ),
        (
            "many",
            "many/talk1.json has 2 frames: expected one frame per file in a folder; give the path of the file instead",
        ),
        ("unnumbered", "unnumbered/first.json: expected the frame number in the file name"),
        ("hands", "hands: frame 0, person 0: `hand_left_keypoints_2d` has 1 point, expected 21"),
        ("void", "void contains no .json files of frames"),
        ("absent.json", "cannot read absent.json: No such file"),
        ("set.h5", "set.h5 is HDF5 (not supported); save its arrays with numpy.savez (PATS: `pose/data`"),
        ("list.npy", "list.npy is not a .npy file of numbers"),
        ("shape.npy", "shape.npy: expected an array `body` [T, 17, 3], MediaPipe landmarks"),
        ("shape.npy", "found: [4, 49, 3]"),
        ("missing.npy", "missing.npy: no person is visible in any frame"),
        ("signed.npy", "signed.npy: coordinates are between -1 and 1: expected pixels (OpenPose: --keypoint_scale 0)"),
    ] {
        let message = message(dir.path(), name);
        assert!(message.contains(expected), "{name}: {message}");
    }
}

#[test]
fn missing_frames_and_non_finite_values_are_undetected_points() {
    let dir = tempfile::tempdir().unwrap();
    let sample = foreign::sample(8, RATE);
    let folder = dir.path().join("gap");
    foreign::openpose(&folder, &sample, OpenPoseOrder::Body25);
    for t in [3, 4] {
        std::fs::remove_file(folder.join(format!("gap_{t:012}_keypoints.json"))).unwrap();
    }
    let found = read(&folder).unwrap();
    assert_eq!(found.notes, ["2 missing frames (the first is number 3): marked as not detected"]);
    assert_eq!((found.frames.len(), found.frames[3].len(), found.frames[5].len()), (8, 0, 1));

    // Python's `json` writes non-finite numbers as NaN and Infinity.
    let path = dir.path().join("nan.json");
    foreign::alphapose(&path, &sample, 17);
    let text = std::fs::read_to_string(&path).unwrap().replacen("320.0,110.0,", "NaN,-Infinity,", 1);
    std::fs::write(&path, text).unwrap();
    let found = read(&path).unwrap();
    let scores: Vec<f32> = found.frames[0][0].body.iter().map(|point| point.score).collect();
    assert!(scores[0] == 0.0 && scores[1..].iter().all(|score| *score > 0.0), "{scores:?}");
}

#[test]
fn lift_asks_for_values_that_the_format_does_not_state() {
    let dir = tempfile::tempdir().unwrap();
    let sample = foreign::sample(20, RATE);
    let (folder, npz, out) = (dir.path().join("op"), dir.path().join("mp.npy"), dir.path().join("j.npy"));
    foreign::openpose(&folder, &sample, OpenPoseOrder::Body25);
    foreign::holistic(&npz, &sample, foreign::HolisticOrder::NoFace);
    let lift = |file: &Path, args: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
        let output = command.arg("lift").arg(file).arg("--out").arg(&out).args(args).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
        (output.status.code(), text)
    };
    let fails = |file: &Path, args: &[&str], expected: &str| {
        let (code, text) = lift(file, args);
        assert!(code.is_some_and(|code| code != 0) && text.contains(expected), "{text}");
    };
    fails(&folder, &[], "op does not state its frame rate; give it with --input-fps");
    fails(&npz, &["--input-fps", "15"], "mp.npy does not state its image size; give it with --size, such as 1280x720");
    fails(&folder, &["--input-fps", "15", "--size", "wide"], "expected width and height in pixels, such as 1280x720");
    let (code, text) = lift(&folder, &["--input-fps", "15"]);
    assert!(code == Some(0) && text.contains("OpenPose, 25 points at 15 fps"), "{text}");
    assert!(text.contains("image size not stated: derived from the outermost points"), "{text}");
    let first = std::fs::read(&out).unwrap();
    let (code, text) = lift(&npz, &["--input-fps", "15", "--size", "640x480"]);
    assert!(code == Some(0) && text.contains("20 frames at 15 fps lifted"), "{text}");
    assert_eq!(first.len(), std::fs::read(&out).unwrap().len());
}

proptest::proptest! {
    #![proptest_config(proptest::test_runner::Config::with_cases(200))]
    #[test]
    fn arbitrary_bytes_do_not_panic(
        text in "\\{?\\[?(\"(people|instance_info|keypoints|image_id|frame_id|annotations|images|id)\" ?: ?)?[\\[{]{0,3}[0-9.,NaIfinty\"-]{0,12}[\\]}]{0,4}|.{0,40}",
        damage in proptest::collection::vec((0usize..4000, proptest::num::u8::ANY), 1..4),
    ) {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.json");
        std::fs::write(&path, &text).unwrap();
        let _ = read(&path);
        foreign::alphapose(&path, &foreign::sample(2, RATE), 17);
        let mut bytes = std::fs::read(&path).unwrap();
        for (at, value) in damage {
            let at = at % bytes.len();
            bytes[at] = value;
        }
        std::fs::write(&path, &bytes).unwrap();
        let _ = read(&path);
    }
}
