//! Readers of captured motion: joints as in the source, in the axes of this project.

use orator_base::types::skeleton::{L_HAND, L_WRIST, N_JOINTS, NECK, R_HAND, R_SHOULDER, R_WRIST, swap_authors_order};
use orator_base::types::time::FrameRate;
use orator_formats::authors_txt;
use orator_formats::mocap::bvh;
use orator_formats::mocap::captured;
use orator_formats::mocap::captured::MotionKind;
use orator_test_support::skip::real_data;
use std::path::Path;

fn reference(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/reference").join(name)
}

#[test]
fn a_bvh_take_has_the_reference_positions() {
    let take = captured::read(MotionKind::Bvh, &reference("bvh_take.bvh")).unwrap();
    let golden: serde_json::Value =
        serde_json::from_slice(&std::fs::read(reference("bvh_golden.json")).unwrap()).unwrap();
    assert_eq!(take.motion.fps, FrameRate::new(30, 1));
    assert_eq!(
        (take.facts["source_unit"].as_str(), take.facts["source_up"].as_str()),
        (Some("centimetre"), Some("+y"))
    );
    assert!(take.facts["joints_missing"].as_array().unwrap().is_empty());
    let mut worst = 0f64;
    for ((t, j, k), &v) in take.motion.joints.indexed_iter() {
        worst = worst.max((golden["joints"][t][j][k].as_f64().unwrap() - f64::from(v)).abs());
    }
    assert!(worst < 1e-6, "{worst} m");
    assert_eq!(take.motion.n_frames(), 9);
    // The speaker faces the camera, so their right is at the left of the image.
    assert!(take.motion.joints[[0, R_SHOULDER, 0]] < -0.1 && take.motion.joints[[0, L_WRIST, 0]] > 0.2);
}

#[test]
fn z_up_inches_and_a_missing_hand_give_the_same_joints() {
    let text = std::fs::read_to_string(reference("bvh_take.bvh")).unwrap();
    let original = captured::read(MotionKind::Bvh, &reference("bvh_take.bvh")).unwrap().motion;
    let dir = tempfile::tempdir().unwrap();
    // An extra root that turns y-up into z-up; lengths in inches.
    let (head, frames) = text.split_once("Frame Time: 0.0333333\n").unwrap();
    let inches = |line: &str| match line.trim_start().strip_prefix("OFFSET ") {
        Some(offset) => {
            let scaled = offset.split(' ').map(|v| format!("{:.7}", v.parse::<f64>().unwrap() / 2.54));
            format!("OFFSET {}", scaled.collect::<Vec<_>>().join(" "))
        }
        None => line.replace("LeftHand", "Tail"),
    };
    let head: Vec<String> = head.lines().map(inches).collect();
    let head = head.join("\n").replacen(
        "ROOT Hips",
        "ROOT Stage {\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nJOINT Hips",
        1,
    );
    let head = head.replacen("MOTION", "}\nMOTION", 1);
    let frames: Vec<String> = frames
        .lines()
        .map(|line| {
            let mut values: Vec<f64> = line.split(' ').map(|v| v.parse().unwrap()).collect();
            values[..3].iter_mut().for_each(|v| *v /= 2.54);
            format!("0 90 0 {}", values.iter().map(f64::to_string).collect::<Vec<_>>().join(" "))
        })
        .collect();
    let path = dir.path().join("other.bvh");
    std::fs::write(&path, format!("{head}\nFrame Time: 0.0333333\n{}\n", frames.join("\n"))).unwrap();
    let take = captured::read(MotionKind::Bvh, &path).unwrap();
    assert_eq!((take.facts["source_unit"].as_str(), take.facts["source_up"].as_str()), (Some("inch"), Some("+z")));
    assert!(bvh::notes(&take.facts)[0].contains("the unit is the inch: converted to metres"));
    assert_eq!(take.facts["joints_missing"].as_array().unwrap().len(), 22, "the left wrist and its hand");
    for ((t, j, k), &v) in take.motion.joints.indexed_iter() {
        let missing = (L_HAND..R_HAND).contains(&j) || j == L_WRIST;
        let error = (v - original.joints[[t, j, k]]).abs();
        assert!(if missing { v.is_nan() && !take.motion.mask[[t, j]] } else { error < 2e-6 }, "{t} {j} {k}: {error}");
    }
}

#[test]
fn a_file_without_a_speaker_is_an_error_with_the_reason() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("b.bvh");
    let text = std::fs::read_to_string(reference("bvh_take.bvh")).unwrap();
    let error_of = |text: &str| {
        std::fs::write(&path, text).unwrap();
        format!("{:#}", captured::read(MotionKind::Bvh, &path).unwrap_err())
    };
    // One arm of an unknown name, as long as no other limb, is not found by structure.
    let unknown = text.replace("LeftShoulder", "Crane").replace("LeftArm", "Crank");
    let named = error_of(&unknown.replace("OFFSET 28.5 0 0", "OFFSET 9 0 0"));
    assert!(named.contains("b.bvh") && named.contains("left shoulder") && named.contains("LeftForeArm"), "{named}");
    let huge = error_of(&text.replace("28.5", "9000"));
    assert!(huge.contains("centimetre"), "{huge}");
    let broken = error_of(&text.replace("Frames: 9", "Frames: 11"));
    assert!(broken.contains("b.bvh") && broken.contains("the file has 9 frames, line "), "{broken}");
}

#[test]
fn ted_joints_keep_their_positions() {
    let Some(folder) = real_data("data/speech_motion/ted_expressive") else { return };
    let take = captured::read(MotionKind::Ted, &folder.join("_3IOjpSGFqY_164_0_12.npz")).unwrap();
    let mut npz = orator_formats::npz::Npz::open(&folder.join("_3IOjpSGFqY_164_0_12.npz")).unwrap();
    let theirs = npz.numbers("human_joints", &[None, Some(43), Some(3)]).unwrap();
    // (ours, theirs): arms, then base and inter of the left index, left little, right thumb
    let pairs = [(1, 3), (2, 5), (3, 7), (4, 2), (5, 4), (6, 6), (12, 8), (13, 9), (24, 14), (29, 35), (31, 37)];
    for t in 0..take.motion.n_frames() {
        for (ours, j) in pairs {
            for k in 0..3 {
                let truth = theirs[[t, j, k]] - theirs[[t, 1, k]];
                assert!((f64::from(take.motion.joints[[t, ours, k]]) - truth).abs() < 1e-6);
            }
        }
        for root in [L_HAND, R_HAND] {
            assert!((0..5).all(|finger| !take.motion.mask[[t, root + 4 + 4 * finger]]), "finger tips are missing");
        }
    }
    assert_eq!(take.motion.n_frames(), 92);
    assert!(take.text.unwrap().starts_with("una risposta  a  questa"));
}

#[test]
fn the_authors_clips_are_only_permuted() {
    let Some(folder) = real_data("data/released_clips") else { return };
    let path = folder.join("gt_interval_3821.txt");
    let take = captured::read(MotionKind::Authors, &path).unwrap();
    let text = std::fs::read_to_string(path).unwrap();
    for (t, line) in text.lines().enumerate() {
        let numbers: Vec<f32> = line.split_whitespace().map(|v| v.parse().unwrap()).collect();
        for j in 0..N_JOINTS {
            for k in 0..3 {
                assert_eq!(take.motion.joints[[t, j, k]], numbers[3 * swap_authors_order(j) + k]);
            }
        }
    }
    assert!(take.motion.joints[[0, R_WRIST, 0]].is_finite());
}

#[test]
fn the_authors_clips_round_trip() {
    let Some(folder) = real_data("data/released_clips") else { return };
    for (name, n_frames) in [("gt_interval_3821", 242), ("gt_interval_102571", 679), ("prediction_interval_3821", 242)]
    {
        let path = folder.join(name).with_extension("txt");
        let motion = authors_txt::read(&path, FrameRate::new(15, 1)).unwrap();
        assert_eq!(motion.n_frames(), n_frames);
        let (written, original) = (authors_txt::format(&motion), std::fs::read_to_string(&path).unwrap());
        assert_eq!(written.len(), original.len(), "{name}: equal length");
        for (ours, theirs) in written.split_whitespace().zip(original.split_whitespace()) {
            let (ours, theirs): (f64, f64) = (ours.parse().unwrap(), theirs.parse().unwrap());
            assert!((ours - theirs).abs() < 4e-8, "{name}: {ours} for {theirs}");
        }
        let distance = |frame: usize, a: usize, b: usize| {
            (0..3).map(|k| (motion.joints[[frame, a, k]] - motion.joints[[frame, b, k]]).powi(2)).sum::<f32>().sqrt()
        };
        let (mut tips_further, mut n_tips) = (0, 0);
        for frame in 0..n_frames {
            assert!((0..3).all(|k| motion.joints[[frame, NECK, k]] == 0.0));
            if name.starts_with("gt") {
                assert!(distance(frame, L_HAND, L_WRIST) < 2e-6 && distance(frame, R_HAND, R_WRIST) < 2e-6);
            }
            for root in [L_HAND, R_HAND] {
                for finger in 0..5 {
                    let base = root + 1 + 4 * finger;
                    n_tips += 1;
                    tips_further += usize::from(distance(frame, root, base + 3) > distance(frame, root, base));
                }
            }
        }
        assert!(tips_further * 10 > n_tips * 8, "{name}: {tips_further} of {n_tips} finger tips lie beyond their base");
    }
}
