//! Keypoints in fractions of the image size are converted to pixels; keypoints outside any image are an error.

use crate::fixtures::keypoints::keypoints;
use ndarray::{Array3, arr1, s};
use ndarray_npy::{NpzWriter, read_npy, write_npy};
use orator_base::types::pose2d::Keypoints;
use orator_lab::train::scene::body::{FilmedScene, Filming};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::fs::File;
use std::path::Path;
use std::process::Command;

fn speaker() -> Keypoints {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    keypoints(&FilmedScene::from_rule(Filming::Clean, 30, &mut rng), &mut rng)
}

/// The keypoints with `transform` applied to x and y of every detected point.
fn transformed(k: &Keypoints, transform: impl Fn([f32; 2]) -> [f32; 2]) -> Keypoints {
    let mut k = k.clone();
    for points in [&mut k.body, &mut k.left_hand, &mut k.right_hand] {
        for mut point in points.lanes_mut(ndarray::Axis(2)) {
            if point[2] > 0.0 {
                let [x, y] = transform([point[0], point[1]]);
                point.slice_mut(s![..2]).assign(&arr1(&[x, y]));
            }
        }
    }
    k
}

fn write(path: &Path, k: &Keypoints, size: Option<[i64; 2]>) {
    let mut npz = NpzWriter::new(File::create(path).unwrap());
    npz.add_array("body", &k.body).unwrap();
    npz.add_array("left_hand", &k.left_hand).unwrap();
    npz.add_array("right_hand", &k.right_hand).unwrap();
    npz.add_array("fps", &arr1(&[15.0])).unwrap();
    if let Some(size) = size {
        npz.add_array("image_size", &arr1(&size)).unwrap();
    }
    npz.finish().unwrap();
}

fn lift(dir: &Path, args: &str) -> (Option<Array3<f32>>, String) {
    let out = dir.join("j.npy");
    let _ = std::fs::remove_file(&out);
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    let output = command.arg("lift").args(args.split(' ')).args(["--out", "j.npy"]).current_dir(dir).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    (output.status.success().then(|| read_npy(&out).unwrap()), text)
}

#[test]
fn fractions_of_the_image_size_are_lifted_as_pixels_or_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    // In a wide image, equal fractions of width and height are different distances.
    let pixels = Keypoints { image_size: [8000, 3000], ..speaker() };
    write(&dir.join("px.npz"), &pixels, Some([8000, 3000]));
    let fractions = transformed(&pixels, |[x, y]| [(x + 0.5) / 8000.0, (y + 0.5) / 3000.0]);
    let expected = lift(dir, "px.npz").0.unwrap();
    for (size, args) in [(Some([8000, 3000]), ""), (None, " --size 8000x3000"), (Some([1, 1]), " --size 8000x3000")] {
        write(&dir.join("shares.npz"), &fractions, size);
        let (joints, text) = lift(dir, &format!("shares.npz{args}"));
        let joints = joints.unwrap_or_else(|| panic!("{text}"));
        let difference =
            joints.iter().zip(&expected).map(|(a, b)| (a - b).abs()).filter(|d| d.is_finite()).fold(0.0, f32::max);
        assert!(difference < 1e-3, "difference of {difference} m");
        assert!(text.contains("interpreted as fractions of the image size, 8000x3000 px"), "{text}");
    }
    for size in [None, Some([1, 1])] {
        write(&dir.join("shares.npz"), &fractions, size);
        let (joints, text) = lift(dir, "shares.npz");
        assert!(
            joints.is_none() && text.contains("shares.npz: coordinates are fractions of the image size (0..1)"),
            "{text}"
        );
        assert!(text.contains("--size 1280x720") && text.contains("image_size"), "{text}");
    }
}

#[test]
fn coordinates_outside_any_image_are_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let k = speaker();
    for (name, transform, expected) in [
        ("far", (|[x, y]| [x * 1e4, y * 1e4]) as fn([f32; 2]) -> [f32; 2], "implausible coordinates (median"),
        ("left", |[x, y]| [x - 4000.0, y], "have a negative x"),
        ("up", |[x, y]| [x, -y], "have a negative y"),
        ("centred", |[x, y]| [x / 2000.0 - 1.0, y / 1500.0 - 1.0], "are between -1 and 1"),
    ] {
        let file = format!("{name}.npz");
        write(&dir.join(&file), &transformed(&k, transform), Some([4000, 3000]));
        let (joints, text) = lift(dir, &file);
        assert!(joints.is_none() && text.contains(&file) && text.contains(expected), "{name}: {text}");
    }
    // PATS coordinates relative to the neck are not pixels.
    let pats =
        Array3::from_shape_fn((20, 52, 2), |(t, j, k)| ((t + 3 * j + k) % 7) as f32 / 7.0 * f32::from(u8::from(j > 0)));
    write_npy(dir.join("pats.npy"), &pats).unwrap();
    let (joints, text) = lift(dir, "pats.npy --size 640x480");
    assert!(joints.is_none() && text.contains("pats.npy") && text.contains("expected pixels of the video"), "{text}");
}
