//! Files of keypoints: contents and rejected files.

use ndarray::{Array1, Array2, Array3};
use orator_base::types::pose2d::{Keypoints, N_BODY, N_HAND};
use orator_base::types::time::FrameRate;
use orator_formats::keypoints_npz::{Extras, FaceFrames, read, read_extras, read_noting, write};
use orator_formats::npz;
use std::path::{Path, PathBuf};

fn body_only(dir: &Path, body: &Array3<f64>) -> PathBuf {
    let path = dir.join("body.npz");
    npz::write(&path, |npz| npz.add_array("body", body)).unwrap();
    path
}

#[test]
fn missing_arrays_are_noted_and_invalid_shapes_are_errors() {
    let dir = tempfile::tempdir().unwrap();
    let mut body = Array3::from_elem((2, N_BODY, 3), 7.0);
    body[[1, 3, 0]] = f64::NAN;
    let (keypoints, notes) = read_noting(&body_only(dir.path(), &body)).unwrap();
    assert_eq!((keypoints.fps, keypoints.image_size, notes.len()), (FrameRate::new(15, 1), [7, 7], 4));
    assert_eq!((keypoints.body[[1, 3, 2]], keypoints.body[[0, 3, 2]]), (0.0, 7.0));
    let empty = read(&body_only(dir.path(), &Array3::zeros((0, N_BODY, 3)))).unwrap();
    assert_eq!(empty.n_frames(), 0);
    let wrong = read(&body_only(dir.path(), &Array3::zeros((2, 18, 3))));
    let text = format!("{:#}", wrong.unwrap_err());
    assert!(text.contains("[2, 18, 3]") && text.contains("[T, 17, 3]"), "{text}");
}

proptest::proptest! {
    #![proptest_config(proptest::test_runner::Config::with_cases(24))]
    #[test]
    fn finite_keypoints_round_trip_with_deterministic_bytes(
        n_frames in 0usize..4,
        sides in [1u32..1_000_000, 1u32..1_000_000],
        has_face in proptest::bool::ANY,
        numbers in proptest::collection::vec(-1e6f32..1e6, 200),
    ) {
        let points = |n: usize| {
            Array3::from_shape_fn((n_frames, n, 3), |(t, j, k)| numbers[(t * 7 + j * 3 + k) % numbers.len()])
        };
        let keypoints = Keypoints {
            fps: FrameRate::new(30_000, 1001),
            image_size: sides,
            body: points(N_BODY),
            hand_depth: Some(Array3::from_elem((n_frames, 2, N_HAND), numbers[0])),
            left_hand: points(N_HAND),
            right_hand: points(N_HAND),
        };
        let extras = Extras {
            time_secs: Array1::from_shape_fn(n_frames, |t| f64::from(numbers[t])),
            person: Array2::from_shape_fn((n_frames, 5), |(t, k)| numbers[5 * t + k]),
            n_persons: Array1::from_shape_fn(n_frames, |t| t as i64),
            identity: Array1::from_shape_fn(n_frames, |t| 3 * t as i64),
            other_hand: Array2::from_shape_fn((n_frames, 2), |(t, side)| numbers[2 * t + side] > 0.0),
            face: has_face.then(|| FaceFrames {
                opening: Array1::from_shape_fn(n_frames, |t| numbers[t + 9]),
                score: Array1::from_shape_fn(n_frames, |t| numbers[t + 5]),
            }),
        };
        let folder = tempfile::tempdir().unwrap();
        let [path, again] = ["a.npz", "b.npz"].map(|name| folder.path().join(name));
        write(&path, &keypoints, &extras).unwrap();
        write(&again, &keypoints, &extras).unwrap();
        proptest::prop_assert_eq!(std::fs::read(&path).unwrap(), std::fs::read(&again).unwrap());
        proptest::prop_assert_eq!(read_noting(&path).unwrap(), (keypoints, Vec::new()));
        proptest::prop_assert_eq!(read_extras(&path).unwrap(), extras);
    }
}
