//! `dataset verify` detects every flipped bit and every truncated, missing or unknown file, and never panics.

use crate::fixtures::samples::constant_sample;
use crate::fixtures::write_dataset::write_dataset;
use orator_base::stage::progress::Silent;
use orator_base::types::time::FrameRate;
use orator_dataset::verify::verify::verify;
use orator_dataset::{Sample, Split};
use orator_test_support::project::files_under;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fs;
use std::path::Path;

fn write(dir: &Path) {
    let samples = [
        (Split::Train, constant_sample("talk-0a1b2c3d-000000", 4, 1)),
        (Split::Train, constant_sample("talk-0a1b2c3d-000102", 3, 2)),
        (Split::Test, constant_sample("walk-99999999-000007", 5, 3)),
    ];
    write_dataset(dir, "host", FrameRate::new(15, 1), &samples).unwrap();
}

fn n_problems(dir: &Path, deep: bool) -> usize {
    verify(dir, deep, &Silent).map_or(1, |found| found.problems.len())
}

#[test]
fn flipped_bits_and_truncated_files_are_all_detected() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path());
    assert_eq!(verify(dir.path(), true, &Silent).unwrap().problems, []);
    let files = files_under(dir.path());
    assert_eq!(files.len(), 11, "{files:?}");
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    for round in 0..1_000 {
        let (name, path) = &files[rng.random_range(0..files.len())];
        let original = fs::read(path).unwrap();
        let at = rng.random_range(0..original.len());
        let mut damaged = original.clone();
        if round % 2 == 0 {
            damaged[at] ^= 1 << rng.random_range(0..8);
        } else {
            damaged.truncate(at);
        }
        fs::write(path, damaged).unwrap();
        assert!(n_problems(dir.path(), true) > 0, "round {round}: {name} at {at}");
        let small = !name.ends_with(".tar");
        assert!(!small || n_problems(dir.path(), false) > 0, "round {round}, fast: {name} at {at}");
        fs::write(path, original).unwrap();
    }
    assert_eq!(n_problems(dir.path(), true), 0);
}

#[test]
fn missing_and_unknown_files_are_named() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path());
    for (name, path) in files_under(dir.path()) {
        let bytes = fs::read(&path).unwrap();
        fs::remove_file(&path).unwrap();
        let found = verify(dir.path(), false, &Silent).unwrap();
        assert!(found.problems.iter().any(|p| format!("{p:?}").contains(&name)), "{name}: {:?}", found.problems);
        fs::write(&path, bytes).unwrap();
    }
    fs::write(dir.path().join("notes.txt"), "mine").unwrap();
    let found = verify(dir.path(), false, &Silent).unwrap();
    assert_eq!(found.problems[0].message, "not part of the dataset");
    assert!(verify(&dir.path().join("nothing"), false, &Silent).unwrap_err().to_string().contains("is not a dataset"));
}

/// Expected message, and the change that causes it.
type InvalidCase = (&'static str, fn(&mut Sample));

/// Impossible values, in files with valid hashes.
#[test]
fn impossible_values_are_detected() {
    let cases: [InvalidCase; 4] = [
        ("the bone to joint 5", |sample| sample.motion.joints[[2, 5, 1]] += 0.01),
        ("but visible in the mask", |sample| {
            sample.motion.joints.slice_mut(ndarray::s![1, 20, ..]).fill(f32::NAN);
            sample.motion.mask[[1, 20]] = true;
        }),
        ("a keypoint is not finite", |sample| sample.pose2d[[0, 3, 0]] = f32::INFINITY),
        ("a keypoint's score", |sample| sample.pose2d[[0, 3, 2]] = 2.0),
    ];
    for (expected, change) in cases {
        let dir = tempfile::tempdir().unwrap();
        // A long valid sample determines the video's median bone lengths.
        let mut invalid = constant_sample("talk-0a1b2c3d-000102", 4, 2);
        change(&mut invalid);
        let samples = [(Split::Train, constant_sample("talk-0a1b2c3d-000000", 40, 1)), (Split::Train, invalid)];
        write_dataset(dir.path(), "host", FrameRate::new(15, 1), &samples).unwrap();
        assert_eq!(verify(dir.path(), false, &Silent).unwrap().problems, []);
        let found = verify(dir.path(), true, &Silent).unwrap();
        assert!(format!("{:?}", found.problems).contains(expected), "{expected}: {:?}", found.problems);
    }
}
