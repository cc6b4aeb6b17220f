//! Point orders that only the number of points identifies: BODY_25 and BODY_25B, old keys of OpenPose, arrays, and points
//! in an order that is none of the known ones.

use crate::fixtures::media::foreign_keypoints as foreign;
use crate::fixtures::media::foreign_keypoints::OpenPoseOrder;
use ndarray::{Array2, Array3};
use ndarray_npy::{NpzWriter, write_npy};
use orator_base::types::pose2d::Keypoints;
use orator_base::types::time::FrameRate;
use orator_formats::keypoints::{FoundKeypoints, read};
use serde_json::{Value, json};
use std::fs::{self, File};
use std::path::Path;

const RATE: FrameRate = FrameRate::new(15, 1);

/// Points of all frames in the order of the format with `n_points` points: x, y, score.
fn points(sample: &Keypoints, n_points: usize) -> Array3<f32> {
    let frames: Vec<Vec<[f32; 3]>> = (0..sample.n_frames()).map(|t| foreign::person(sample, t, n_points)).collect();
    Array3::from_shape_fn((frames.len(), n_points, 3), |(t, j, k)| frames[t][j][k])
}

fn assert_body(found: &FoundKeypoints, sample: &Keypoints, score: Option<f32>) {
    assert_eq!(found.frames.len(), sample.n_frames());
    for (t, frame) in found.frames.iter().enumerate() {
        for (j, point) in frame[0].body.iter().enumerate() {
            let expected = [0, 1, 2].map(|k| sample.body[[t, j, k]]);
            assert_eq!([point.x, point.y], expected[..2], "frame {t}, point {j}");
            assert_eq!(point.score, score.unwrap_or(expected[2]), "frame {t}, point {j}");
        }
    }
}

#[test]
fn the_two_orders_of_25_points_are_distinguished() {
    let dir = tempfile::tempdir().unwrap();
    let mut sample = foreign::sample(8, RATE);
    for (name, order, format) in [
        ("25", OpenPoseOrder::Body25, "OpenPose, 25 points"),
        ("25b", OpenPoseOrder::Body25B, "OpenPose, 25 points (BODY_25B)"),
    ] {
        let folder = dir.path().join(name);
        foreign::openpose(&folder, &sample, order);
        let found = read(&folder).unwrap();
        assert_eq!(found.format, format);
        assert_body(&found, &sample, None);
        assert_eq!(found.frames[7][0].left_hand[20].x, sample.left_hand[[7, 20, 0]]);
    }
    // Seen from the side: shoulders, ears and eyes nearly coincide; most frames lack the legs.
    for mut frame in sample.body.outer_iter_mut() {
        for (j, mut point) in frame.outer_iter_mut().enumerate() {
            point[0] = if j < 5 { 300.0 - 4.0 * j as f32 } else { 330.0 + 0.1 * (point[0] - 320.0) };
            point[2] *= if j > 12 { 0.0 } else { 1.0 };
        }
    }
    sample.body.slice_mut(ndarray::s![.., 13.., ..]).fill(0.0);
    for (name, order) in [("side25", OpenPoseOrder::Body25), ("side25b", OpenPoseOrder::Body25B)] {
        let folder = dir.path().join(name);
        foreign::openpose(&folder, &sample, order);
        assert_body(&read(&folder).unwrap(), &sample, None);
    }
}

#[test]
fn keys_of_openpose_before_1_3_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let sample = foreign::sample(6, RATE);
    for (name, order) in [("new18", OpenPoseOrder::Coco18), ("new25", OpenPoseOrder::Body25)] {
        let (new, old) = (dir.path().join(name), dir.path().join(name.replace("new", "old")));
        foreign::openpose(&new, &sample, order);
        fs::create_dir(&old).unwrap();
        for entry in fs::read_dir(&new).unwrap() {
            let file = entry.unwrap();
            let text = fs::read_to_string(file.path()).unwrap().replace("keypoints_2d", "keypoints");
            assert!(text.contains("\"hand_right_keypoints\""));
            fs::write(old.join(file.file_name()), text).unwrap();
        }
        assert_eq!(read(&old).unwrap(), read(&new).unwrap());
    }
    let unknown = dir.path().join("unknown");
    foreign::openpose_folder(&unknown, 1, |_| vec![json!({ "body_parts": [1, 2, 1] })]);
    let message = format!("{:#}", read(&unknown).unwrap_err());
    assert!(message.contains("person 0 of `people` has no `pose_keypoints_2d`"), "{message}");
}

#[test]
fn arrays_of_coco_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let sample = foreign::sample(7, RATE);
    let (coco, wholebody) = (points(&sample, 17), points(&sample, 133));
    let positions = |points: &Array3<f32>| points.slice(ndarray::s![.., .., ..2]).as_standard_layout().to_owned();
    write_npy(at("coco.npy"), &positions(&coco)).unwrap();
    write_npy(at("whole.npy"), &wholebody).unwrap();
    let mut npz = NpzWriter::new(File::create(at("scored.npz")).unwrap());
    npz.add_array("keypoints", &positions(&wholebody)).unwrap();
    npz.add_array("keypoint_scores", &Array2::from_shape_fn((7, 133), |(t, j)| wholebody[[t, j, 2]])).unwrap();
    npz.add_array("fps", &ndarray::arr1(&[25i64])).unwrap();
    npz.finish().unwrap();
    for (name, n_points, score) in [("coco.npy", 17, Some(1.0)), ("whole.npy", 133, None), ("scored.npz", 133, None)] {
        let found = read(&at(name)).unwrap();
        assert_eq!(found.format, format!("keypoint array, {n_points} points"));
        assert_body(&found, &sample, score);
        let hand = found.frames[3][0].right_hand[9];
        assert_eq!(hand.x, if n_points == 133 { sample.right_hand[[3, 9, 0]] } else { 0.0 });
    }
    assert_eq!(read(&at("scored.npz")).unwrap().fps, Some(FrameRate::new(25, 1)));
    let mut depths = coco.clone();
    depths.slice_mut(ndarray::s![.., 4.., 2]).fill(-0.2);
    write_npy(at("depths.npy"), &depths).unwrap();
    let message = format!("{:#}", read(&at("depths.npy")).unwrap_err());
    assert!(message.contains("depths.npy: the third number of a point of [7, 17, 3] is negative"), "{message}");
}

/// Error for a list of persons whose point `k` is point `order(k)` of COCO, changed by `change`.
fn error_of(dir: &Path, order: impl Fn(usize) -> usize, change: impl Fn([f32; 3]) -> [f32; 3]) -> String {
    let sample = points(&foreign::sample(8, RATE), 17);
    let person =
        |t: usize| -> Vec<f32> { (0..17).flat_map(|j| change([0, 1, 2].map(|k| sample[[t, order(j), k]]))).collect() };
    let list: Value = (0..8).map(|t| json!({ "image_id": format!("{t}.jpg"), "keypoints": person(t) })).collect();
    fs::write(dir.join("list.json"), list.to_string()).unwrap();
    read(&dir.join("list.json")).err().map_or(String::new(), |error| format!("{error:#}"))
}

#[test]
fn points_in_an_unknown_order_are_rejected_with_the_assumed_order() {
    let dir = tempfile::tempdir().unwrap();
    let same = |point: [f32; 3]| point;
    assert_eq!(error_of(dir.path(), |j| j, same), "");
    // Hip, right leg, left leg, spine, neck, nose, head, left arm, right arm.
    let from_the_hips = [11, 12, 14, 16, 11, 13, 15, 5, 6, 0, 1, 5, 7, 9, 6, 8, 10];
    for (expected, message) in [
        ("order of COCO, but ", error_of(dir.path(), |j| from_the_hips[j], same)),
        (
            "the face is as large as an arm is long",
            error_of(dir.path(), |j| [0, 15, 16, 13, 14, 5, 6, 7, 8, 9, 10, 11, 12, 1, 2, 3, 4][j], same),
        ),
        (
            "the left upper arm is 6 times as long as the right upper arm",
            error_of(dir.path(), |j| [0, 1, 2, 3, 4, 5, 1, 7, 3, 9, 4, 11, 12, 13, 14, 15, 16][j], same),
        ),
        (
            "left and right of the hips and of the shoulders",
            error_of(dir.path(), |j| if j == 11 || j == 12 { 23 - j } else { j }, same),
        ),
        (
            "the nose is below the shoulders (y must point down)",
            error_of(dir.path(), |j| j, |[x, y, s]| [x, 480.0 - y, s]),
        ),
    ] {
        assert!(message.contains(expected) && message.contains("list.json: by their number"), "{expected}: {message}");
        assert!(message.contains("as `body` [T, 17, 3]"), "{message}");
    }
}
