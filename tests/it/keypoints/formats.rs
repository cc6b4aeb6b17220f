//! Every keypoint format is read as its program writes it, resampled to another rate, and reduced to one person.

use crate::fixtures::media::foreign_keypoints as foreign;
use crate::fixtures::media::foreign_keypoints::{HolisticOrder, OpenPoseOrder};
use ndarray::Array3;
use orator_base::types::pose2d::Keypoints;
use orator_base::types::time::FrameRate;
use orator_formats::keypoints::{CoordinateUnit, FoundKeypoints, read};
use orator_formats::keypoints_npz;
use orator_pipeline::keypoints::{ConvertedKeypoints, convert};
use std::path::Path;

const RATE: FrameRate = FrameRate::new(15, 1);
const SIZE: [u32; 2] = [640, 480];
/// Body keypoints that PATS does not have: ears, hips, knees, ankles.
const NOT_IN_PATS: [usize; 8] = [3, 4, 11, 12, 13, 14, 15, 16];

/// The part of the sample that a format stores.
#[derive(Clone, Copy, PartialEq)]
enum Content {
    All,
    BodyOnly,
    /// All points, with visibilities or coordinates only: scores are 1.
    NoScores,
    /// All points, with scores of the body only.
    BodyScores,
}

fn converted(found: FoundKeypoints) -> ConvertedKeypoints {
    convert(found, RATE, SIZE, RATE).unwrap()
}

fn assert_close(label: &str, found: &Array3<f32>, expected: &Array3<f32>, scores: Option<f32>, absent: &[usize]) {
    assert_eq!(found.shape(), expected.shape(), "{label}");
    for ((at, &value), &wanted) in found.indexed_iter().zip(expected) {
        let wanted = match scores {
            _ if absent.contains(&at.1) => 0.0,
            Some(score) if at.2 == 2 => score,
            _ => wanted,
        };
        assert!((value - wanted).abs() < 1e-3, "{label} {at:?}: {value}, expected {wanted}");
    }
}

fn compare(label: &str, found: &Keypoints, expected: &Keypoints, content: Content) {
    let absent: Vec<usize> = if content == Content::BodyOnly { (0..21).collect() } else { Vec::new() };
    let body_scores = (content == Content::NoScores).then_some(1.0);
    let hand_scores = matches!(content, Content::NoScores | Content::BodyScores).then_some(1.0);
    assert_close(&format!("{label}: body"), &found.body, &expected.body, body_scores, &[]);
    assert_close(&format!("{label}: left hand"), &found.left_hand, &expected.left_hand, hand_scores, &absent);
    assert_close(&format!("{label}: right hand"), &found.right_hand, &expected.right_hand, hand_scores, &absent);
}

#[test]
fn every_format_is_read_as_it_was_written() {
    let dir = tempfile::tempdir().unwrap();
    let sample = foreign::sample(6, RATE);
    let at = |name: &str| dir.path().join(name);
    foreign::openpose(&at("body25"), &sample, OpenPoseOrder::Body25);
    foreign::openpose(&at("coco18"), &sample, OpenPoseOrder::Coco18);
    for (name, n_points) in [("17", 17), ("133", 133)] {
        foreign::mmpose(&at(&format!("mm{name}.json")), &sample, n_points);
        foreign::mmpose_list(&at(&format!("list{name}.json")), &sample, n_points);
        foreign::mmpose_old(&at(&format!("old{name}.json")), &sample, n_points);
    }
    for n_points in [17, 26, 136] {
        foreign::alphapose(&at(&format!("alpha{n_points}.json")), &sample, n_points);
    }
    foreign::wholebody(&at("wholebody.json"), &sample);
    foreign::mediapipe(&at("mediapipe.npz"), &sample);
    for order in [HolisticOrder::NoFace, HolisticOrder::PoseFirst, HolisticOrder::FaceFirst, HolisticOrder::Flat] {
        foreign::holistic(&at(&format!("{order:?}.npy")), &sample, order);
    }
    for (name, format, content) in [
        ("body25", "OpenPose, 25 points", Content::All),
        ("coco18", "OpenPose, 18 points", Content::All),
        ("mm17.json", "MMPose, 17 points", Content::BodyOnly),
        ("mm133.json", "MMPose, 133 points", Content::All),
        ("list17.json", "MMPose, 17 points", Content::BodyOnly),
        ("list133.json", "MMPose, 133 points", Content::All),
        ("old17.json", "MMPose, 17 points", Content::BodyOnly),
        ("old133.json", "MMPose, 133 points", Content::All),
        ("alpha17.json", "AlphaPose, 17 points", Content::BodyOnly),
        ("alpha26.json", "AlphaPose, 26 points", Content::BodyOnly),
        ("alpha136.json", "AlphaPose, 136 points", Content::All),
        ("wholebody.json", "COCO-WholeBody, 17 points", Content::NoScores),
        ("mediapipe.npz", "MediaPipe, pose and hands", Content::BodyScores),
        ("NoFace.npy", "MediaPipe, pose and hands", Content::NoScores),
        ("PoseFirst.npy", "MediaPipe, pose and hands", Content::NoScores),
        ("FaceFirst.npy", "MediaPipe, pose and hands", Content::NoScores),
        ("Flat.npy", "MediaPipe, pose and hands", Content::BodyScores),
    ] {
        let found = read(&at(name)).unwrap();
        assert_eq!((found.format.as_str(), found.notes.len()), (format, 0), "{name}: {:?}", found.notes);
        let converted = converted(found);
        compare(name, &converted.keypoints, &sample, content);
        assert_eq!(
            (converted.notes.len(), converted.extras.n_persons[3], converted.keypoints.image_size),
            (0, 1, SIZE),
            "{name}"
        );
    }
    let header = |name: &str| read(&at(name)).map(|found| (found.fps, found.image_size)).unwrap();
    assert_eq!(header("mediapipe.npz"), (Some(RATE), Some(SIZE)));
    assert_eq!((header("wholebody.json"), header("body25")), ((None, Some(SIZE)), (None, None)));
}

#[test]
fn pats_is_read_in_pixels_and_relative_to_the_neck() {
    let dir = tempfile::tempdir().unwrap();
    let sample = foreign::sample(5, RATE);
    let path = dir.path().join("pats.npz");
    foreign::pats(&path, &sample, false);
    let found = read(&path).unwrap();
    assert_eq!((found.unit, found.fps), (CoordinateUnit::Pixels, Some(RATE)));
    let pixels = converted(found).keypoints;
    assert_close("body", &pixels.body, &sample.body, None, &NOT_IN_PATS);
    assert_close("left hand", &pixels.left_hand, &sample.left_hand, None, &[]);
    assert_close("right hand", &pixels.right_hand, &sample.right_hand, None, &[]);
    foreign::pats(&path, &sample, true);
    let found = read(&path).unwrap();
    assert_eq!(found.unit, CoordinateUnit::FromNeck);
    let body = converted(found).keypoints.body;
    let to = |body: &Array3<f32>, a: usize, b: usize| [0, 1].map(|k| body[[2, b, k]] - body[[2, a, k]]);
    let (moved, original) = (to(&body, 5, 9), to(&sample.body, 5, 9));
    assert!((moved[0] - original[0]).abs() < 1e-3 && (moved[1] - original[1]).abs() < 1e-3);
    let neck = (body[[2, 5, 0]] + body[[2, 6, 0]]) / 2.0;
    assert!((neck - 320.0).abs() < 1e-3, "{neck}");
}

#[test]
fn the_programs_own_keypoints_can_be_read_back() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("own.npz");
    let first = converted(sample_found(dir.path()));
    keypoints_npz::write(&path, &first.keypoints, &first.extras).unwrap();
    let found = read(&path).unwrap();
    assert_eq!((found.fps, found.image_size, found.notes.len()), (Some(RATE), Some(SIZE), 0));
    assert_eq!(converted(found).keypoints, first.keypoints);
}

fn sample_found(dir: &Path) -> FoundKeypoints {
    foreign::openpose(&dir.join("sample"), &foreign::sample(6, RATE), OpenPoseOrder::Body25);
    read(&dir.join("sample")).unwrap()
}

#[test]
fn known_motion_is_preserved_at_another_rate() {
    let dir = tempfile::tempdir().unwrap();
    for (num, den) in [(30, 1), (25, 1), (30_000, 1001), (25, 2), (15, 1), (60, 1)] {
        let source = FrameRate::new(num, den);
        let n_frames = 4 * num as usize / den as usize;
        let folder = dir.path().join(format!("at{num}of{den}"));
        foreign::openpose(&folder, &foreign::sample(n_frames, source), OpenPoseOrder::Body25);
        let converted = convert(read(&folder).unwrap(), source, SIZE, RATE).unwrap();
        let keypoints = &converted.keypoints;
        assert_eq!(keypoints.n_frames(), RATE.frames_in(source.secs(n_frames)), "{source}");
        assert!((converted.duration_secs - source.secs(n_frames)).abs() < 1e-9);
        // The last frame may lie after the last frame of the source.
        for t in 0..keypoints.n_frames() - 1 {
            let moved = (RATE.secs(t) * source.per_sec()) as f32;
            for array in [&keypoints.body, &keypoints.right_hand] {
                let found = [0, 1].map(|k| array[[t, 7, k]] - array[[0, 7, k]]);
                let off = (found[0] - 0.5 * moved).hypot(found[1] + 0.25 * moved);
                assert!(off < 1e-2, "{source}, frame {t}: {found:?} after {moved} frames");
            }
        }
    }
}

#[test]
fn the_largest_of_several_persons_is_tracked_and_the_others_counted() {
    let dir = tempfile::tempdir().unwrap();
    let sample = foreign::sample(30, RATE);
    let mut guest = sample.clone();
    for points in [&mut guest.body, &mut guest.left_hand, &mut guest.right_hand] {
        for mut point in points.lanes_mut(ndarray::Axis(2)) {
            (point[0], point[1]) = (point[0] * 0.2 + 500.0, point[1] * 0.2 + 300.0);
        }
    }
    let folder = dir.path().join("two");
    foreign::openpose_folder(&folder, 30, |t| {
        let mut persons = vec![
            foreign::openpose_person(&sample, t, OpenPoseOrder::Body25),
            foreign::openpose_person(&guest, t, OpenPoseOrder::Body25),
        ];
        persons.rotate_left(t % 2);
        persons.truncate(if (20..22).contains(&t) { 1 + t % 2 } else { 2 });
        persons
    });
    let converted = converted(read(&folder).unwrap());
    compare("two persons", &converted.keypoints, &sample, Content::All);
    assert_eq!(
        converted.notes,
        ["up to 2 persons in a frame (several in 97 % of the frames); one of them is followed"]
    );
    assert!(converted.extras.identity.iter().all(|number| *number == 0));
    assert_eq!((converted.extras.n_persons[0], converted.extras.n_persons[20]), (2, 1));
}
