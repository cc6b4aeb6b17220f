//! Empty, invalid or degenerate keypoints give a clear error, or missing joints (NaN) with a note; never a zero pose.

use crate::fixtures::keypoints::keypoints;
use ndarray::{Array1, Array3, s};
use ndarray_npy::{NpzWriter, read_npy};
use orator_base::types::pose2d::{Keypoints, coco};
use orator_lab::train::scene::body::{FilmedScene, Filming};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::path::PathBuf;
use std::process::Command;

fn speaker(n_frames: usize) -> Keypoints {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    keypoints(&FilmedScene::from_rule(Filming::Clean, n_frames, &mut rng), &mut rng)
}

/// Temporary folder in which `orator lift` runs.
struct LiftFolder {
    dir: tempfile::TempDir,
}

/// Exit code and output of the command, and the joints and extra points if it wrote them.
struct Answer {
    code: Option<i32>,
    text: String,
    joints: Option<Array3<f32>>,
    extra: Option<Array3<f32>>,
}

impl LiftFolder {
    fn new() -> Self {
        Self { dir: tempfile::tempdir().unwrap() }
    }

    fn at(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Runs `orator lift` on these arrays.
    fn lift(&self, k: &Keypoints, fps: &[f64], image_size: &[i64]) -> Answer {
        let mut npz = NpzWriter::new(std::fs::File::create(self.at("k.npz")).unwrap());
        npz.add_array("body", &k.body).unwrap();
        npz.add_array("left_hand", &k.left_hand).unwrap();
        npz.add_array("right_hand", &k.right_hand).unwrap();
        npz.add_array("fps", &Array1::from(fps.to_vec())).unwrap();
        npz.add_array("image_size", &Array1::from(image_size.to_vec())).unwrap();
        npz.finish().unwrap();
        let (out, extra) = (self.at("j.npy"), self.at("e.npy"));
        for file in [&out, &extra] {
            let _ = std::fs::remove_file(file);
        }
        let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
        command.arg("lift").arg(self.at("k.npz")).arg("--out").arg(&out).arg("--extra").arg(&extra);
        let done = command.output().unwrap();
        let text = String::from_utf8_lossy(&done.stdout).into_owned() + &String::from_utf8_lossy(&done.stderr);
        assert!(!text.contains("panicked"), "{text}");
        Answer { code: done.status.code(), text, joints: read_npy(&out).ok(), extra: read_npy(&extra).ok() }
    }

    fn fails(&self, k: &Keypoints, fps: &[f64], image_size: &[i64], expected: &[&str]) {
        let answer = self.lift(k, fps, image_size);
        assert_eq!(answer.code, Some(1), "{}", answer.text);
        assert!(answer.joints.is_none() && answer.extra.is_none(), "no file is written");
        assert!(
            answer.text.contains("k.npz") && expected.iter().all(|part| answer.text.contains(part)),
            "{}",
            answer.text
        );
    }

    fn lifts(&self, k: &Keypoints, fps: &[f64]) -> (Array3<f32>, Array3<f32>, String) {
        let answer = self.lift(k, fps, &[4000, 3000]);
        assert_eq!(answer.code, Some(0), "{}", answer.text);
        let (joints, extra) = (answer.joints.unwrap(), answer.extra.unwrap());
        assert_eq!((joints.dim().0, extra.dim()), (k.n_frames(), (k.n_frames(), 3, 3)));
        // Not a zero pose: the distance from neck to shoulder is plausible, or the joint is missing.
        for frame in joints.outer_iter() {
            let width = frame.slice(s![1, ..]).mapv(|v| v * v).sum().sqrt();
            assert!(width.is_nan() || (0.1..0.3).contains(&width), "half a shoulder width of {width} m");
        }
        (joints, extra, answer.text)
    }
}

#[test]
fn keypoints_that_cannot_be_lifted_are_an_error() {
    let (folder, k) = (LiftFolder::new(), speaker(20));
    let cut = |n: usize, joints: usize| {
        let first = |array: &Array3<f32>| array.slice(s![..n, .., ..]).to_owned();
        let body = Array3::from_shape_fn((n, joints, 3), |(t, j, c)| k.body[[t, j % 17, c]]);
        Keypoints { body, left_hand: first(&k.left_hand), right_hand: first(&k.right_hand), ..k.clone() }
    };
    let (fps, size) = ([15.0, 1.0], [4000, 3000]);
    folder.fails(&cut(0, 17), &fps, &size, &["no frames", "at least 1"]);
    folder.fails(&cut(20, 18), &fps, &size, &["[20, 18, 3]", "[T, 17, 3]"]);
    folder.fails(&cut(20, 16), &fps, &size, &["[20, 16, 3]", "[T, 17, 3]"]);
    folder.fails(&Keypoints { left_hand: Array3::zeros((19, 21, 3)), ..k.clone() }, &fps, &size, &["[20, 21, 3]"]);
    folder.fails(&k, &fps, &[0, 720], &["image_size", "width and height"]);
    folder.fails(&k, &fps, &[1280], &["image_size", "[2]"]);
    for fps in [&[0.0][..], &[f64::NAN], &[-15.0], &[15.0, 0.0], &[f64::INFINITY], &[15.0, 1.0, 2.0]] {
        folder.fails(&k, fps, &size, &["invalid frame rate", "numerator and denominator"]);
    }
}

#[test]
fn missing_bodies_give_missing_joints_and_a_note_with_the_cause() {
    let folder = LiftFolder::new();
    let mut k = speaker(40);
    k.body.slice_mut(s![.., coco::R_SHOULDER, 2]).fill(0.0);
    let (joints, extra, text) = folder.lifts(&k, &[15.0]);
    assert!(joints.iter().chain(&extra).all(|v| v.is_nan()));
    assert!(
        text.contains("no body in 40 of 40 frames") && text.contains("right shoulder is not detected in 40"),
        "{text}"
    );
    k.body.fill(0.0);
    let (joints, _, text) = folder.lifts(&k, &[15.0]);
    assert!(joints.iter().all(|v| v.is_nan()) && text.contains("no body in 40 of 40 frames"), "{text}");
    for invalid in [f32::NAN, f32::INFINITY, 1e30, -1e30] {
        let mut k = speaker(40);
        k.body.fill(invalid);
        k.left_hand.fill(invalid);
        assert!(folder.lifts(&k, &[15.0]).0.iter().all(|v| v.is_nan()), "{invalid}");
        // Less than a second of invalid values is filled from the valid frames around it.
        let mut k = speaker(60);
        k.body.slice_mut(s![20..30, .., ..2]).fill(invalid);
        k.right_hand.slice_mut(s![20..30, .., ..]).fill(invalid);
        let (joints, extra, text) = folder.lifts(&k, &[15.0]);
        assert!(joints.iter().chain(&extra).all(|v| v.is_finite()), "{invalid}");
        assert!(!text.contains("no body"), "{text}");
    }
}

#[test]
fn a_point_missing_in_all_frames_affects_only_dependent_joints() {
    let folder = LiftFolder::new();
    let without = |points: &[usize]| {
        let mut k = speaker(40);
        points.iter().for_each(|&j| k.body.slice_mut(s![.., j, ..]).fill(0.0));
        k
    };
    let known = |array: &Array3<f32>, j: usize| array.slice(s![.., j, ..]).iter().all(|v| v.is_finite());
    // Without hips and legs, then without the face.
    let (joints, extra, _) = folder.lifts(&without(&[11, 12, 13, 14, 15, 16]), &[15.0]);
    assert!((0..49).all(|j| known(&joints, j)) && known(&extra, 0) && !known(&extra, 1) && !known(&extra, 2));
    let (joints, extra, _) = folder.lifts(&without(&[0, 1, 2, 3, 4]), &[15.0]);
    assert!((0..49).all(|j| known(&joints, j)) && !known(&extra, 0) && known(&extra, 1));
    // Without an elbow, its forearm and hand are missing; the other arm is complete.
    let (joints, _, _) = folder.lifts(&without(&[coco::R_ELBOW]), &[15.0]);
    assert!(
        joints.slice(s![.., 2..4, ..]).iter().all(|v| v.is_nan())
            && joints.slice(s![.., 28.., ..]).iter().all(|v| v.is_nan())
    );
    assert!(known(&joints, 1) && (4..28).all(|j| known(&joints, j)));
}

#[test]
fn any_length_and_any_rate_is_lifted() {
    let folder = LiftFolder::new();
    for n_frames in [1, 2, 3] {
        let (joints, extra, _) = folder.lifts(&speaker(n_frames), &[15.0]);
        assert!(joints.iter().chain(&extra).all(|v| v.is_finite()), "{n_frames} frames");
    }
    for fps in [1.0, 240.0, 29.97, 0.5] {
        let (joints, _, _) = folder.lifts(&speaker(50), &[fps]);
        assert!(joints.iter().all(|v| v.is_finite()), "{fps} fps");
    }
}
