//! Keypoints that are empty, wrong or odd: a clear error, or missing joints (NaN) with a note; never a pose of zeros.

use crate::fixtures::keypoints::keypoints;
use ndarray::{Array1, Array3, s};
use ndarray_npy::{NpzWriter, read_npy};
use orator_base::types::pose2d::{Keypoints, coco};
use orator_lab::train::scene::body::{FilmedScene, Filming};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::path::PathBuf;
use std::process::Command;

fn talker(n_frames: usize) -> Keypoints {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    keypoints(&FilmedScene::from_rule(Filming::Clean, n_frames, &mut rng), &mut rng)
}

/// A folder to lift in.
struct Bench {
    dir: tempfile::TempDir,
}

/// What the verb said, and the joints and extra points if it wrote them.
struct Answer {
    code: Option<i32>,
    said: String,
    joints: Option<Array3<f32>>,
    extra: Option<Array3<f32>>,
}

impl Bench {
    fn new() -> Self {
        Self { dir: tempfile::tempdir().unwrap() }
    }

    fn at(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// `orator lift` of these arrays.
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
        let said = String::from_utf8_lossy(&done.stdout).into_owned() + &String::from_utf8_lossy(&done.stderr);
        assert!(!said.contains("panicked"), "{said}");
        Answer { code: done.status.code(), said, joints: read_npy(&out).ok(), extra: read_npy(&extra).ok() }
    }

    fn fails(&self, k: &Keypoints, fps: &[f64], image_size: &[i64], says: &[&str]) {
        let answer = self.lift(k, fps, image_size);
        assert_eq!(answer.code, Some(1), "{}", answer.said);
        assert!(answer.joints.is_none() && answer.extra.is_none(), "nothing is written");
        assert!(answer.said.contains("k.npz") && says.iter().all(|part| answer.said.contains(part)), "{}", answer.said);
    }

    fn lifts(&self, k: &Keypoints, fps: &[f64]) -> (Array3<f32>, Array3<f32>, String) {
        let answer = self.lift(k, fps, &[4000, 3000]);
        assert_eq!(answer.code, Some(0), "{}", answer.said);
        let (joints, extra) = (answer.joints.unwrap(), answer.extra.unwrap());
        assert_eq!((joints.dim().0, extra.dim()), (k.n_frames(), (k.n_frames(), 3, 3)));
        // no pose of zeros: a shoulder is where it belongs, or missing
        for frame in joints.outer_iter() {
            let width = frame.slice(s![1, ..]).mapv(|v| v * v).sum().sqrt();
            assert!(width.is_nan() || (0.1..0.3).contains(&width), "half a shoulder width of {width} m");
        }
        (joints, extra, answer.said)
    }
}

#[test]
fn what_cannot_be_lifted_says_so() {
    let (bench, k) = (Bench::new(), talker(20));
    let cut = |n: usize, joints: usize| {
        let piece = |array: &Array3<f32>| array.slice(s![..n, .., ..]).to_owned();
        let body = Array3::from_shape_fn((n, joints, 3), |(t, j, c)| k.body[[t, j % 17, c]]);
        Keypoints { body, left_hand: piece(&k.left_hand), right_hand: piece(&k.right_hand), ..k.clone() }
    };
    let (fps, size) = ([15.0, 1.0], [4000, 3000]);
    bench.fails(&cut(0, 17), &fps, &size, &["no frames", "at least 1"]);
    bench.fails(&cut(20, 18), &fps, &size, &["[20, 18, 3]", "[T, 17, 3]"]);
    bench.fails(&cut(20, 16), &fps, &size, &["[20, 16, 3]", "[T, 17, 3]"]);
    bench.fails(&Keypoints { left_hand: Array3::zeros((19, 21, 3)), ..k.clone() }, &fps, &size, &["[20, 21, 3]"]);
    bench.fails(&k, &fps, &[0, 720], &["image_size", "width and height"]);
    bench.fails(&k, &fps, &[1280], &["image_size", "[2]"]);
    for fps in [&[0.0][..], &[f64::NAN], &[-15.0], &[15.0, 0.0], &[f64::INFINITY], &[15.0, 1.0, 2.0]] {
        bench.fails(&k, fps, &size, &["invalid frame rate", "numerator and denominator"]);
    }
}

#[test]
fn bodies_that_are_not_there_are_missing_and_a_note_says_why() {
    let bench = Bench::new();
    let mut k = talker(40);
    k.body.slice_mut(s![.., coco::R_SHOULDER, 2]).fill(0.0);
    let (joints, extra, said) = bench.lifts(&k, &[15.0]);
    assert!(joints.iter().chain(&extra).all(|v| v.is_nan()));
    assert!(
        said.contains("no body in 40 of 40 frames") && said.contains("right shoulder is not detected in 40"),
        "{said}"
    );
    k.body.fill(0.0);
    let (joints, _, said) = bench.lifts(&k, &[15.0]);
    assert!(joints.iter().all(|v| v.is_nan()) && said.contains("no body in 40 of 40 frames"), "{said}");
    for odd in [f32::NAN, f32::INFINITY, 1e30, -1e30] {
        let mut k = talker(40);
        k.body.fill(odd);
        k.left_hand.fill(odd);
        assert!(bench.lifts(&k, &[15.0]).0.iter().all(|v| v.is_nan()), "{odd}");
        // a second of it among good frames leaves the rest as it is
        let mut k = talker(60);
        k.body.slice_mut(s![20..30, .., ..2]).fill(odd);
        k.right_hand.slice_mut(s![20..30, .., ..]).fill(odd);
        let (joints, extra, said) = bench.lifts(&k, &[15.0]);
        assert!(joints.iter().chain(&extra).all(|v| v.is_finite()), "{odd}");
        assert!(!said.contains("no body"), "{said}");
    }
}

#[test]
fn what_is_missing_throughout_does_not_take_the_rest_with_it() {
    let bench = Bench::new();
    let gone = |points: &[usize]| {
        let mut k = talker(40);
        points.iter().for_each(|&j| k.body.slice_mut(s![.., j, ..]).fill(0.0));
        k
    };
    let told = |array: &Array3<f32>, j: usize| array.slice(s![.., j, ..]).iter().all(|v| v.is_finite());
    // legs and hips, then face
    let (joints, extra, _) = bench.lifts(&gone(&[11, 12, 13, 14, 15, 16]), &[15.0]);
    assert!((0..49).all(|j| told(&joints, j)) && told(&extra, 0) && !told(&extra, 1) && !told(&extra, 2));
    let (joints, extra, _) = bench.lifts(&gone(&[0, 1, 2, 3, 4]), &[15.0]);
    assert!((0..49).all(|j| told(&joints, j)) && !told(&extra, 0) && told(&extra, 1));
    // an elbow: the arm and hand that hang on it are missing, the other is there
    let (joints, _, _) = bench.lifts(&gone(&[coco::R_ELBOW]), &[15.0]);
    assert!(
        joints.slice(s![.., 2..4, ..]).iter().all(|v| v.is_nan())
            && joints.slice(s![.., 28.., ..]).iter().all(|v| v.is_nan())
    );
    assert!(told(&joints, 1) && (4..28).all(|j| told(&joints, j)));
}

#[test]
fn any_length_and_any_rate_is_lifted() {
    let bench = Bench::new();
    for n_frames in [1, 2, 3] {
        let (joints, extra, _) = bench.lifts(&talker(n_frames), &[15.0]);
        assert!(joints.iter().chain(&extra).all(|v| v.is_finite()), "{n_frames} frames");
    }
    for fps in [1.0, 240.0, 29.97, 0.5] {
        let (joints, _, _) = bench.lifts(&talker(50), &[fps]);
        assert!(joints.iter().all(|v| v.is_finite()), "{fps} frames a second");
    }
}
