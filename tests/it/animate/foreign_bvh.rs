//! BVH files as other programs write them: frame counts, frame times, encodings, units of length and forearms without
//! hands.

use orator_base::types::skeleton::{L_ELBOW, L_HAND, L_WRIST, R_ELBOW, R_WRIST};
use orator_base::types::time::FrameRate;
use orator_dataset::import::find::TakeFiles;
use orator_dataset::import::take::{ImportedTake, TakeLimits, TakeOutcome};
use orator_formats::bvh::read::{Bvh, Positions};
use orator_formats::mocap::bvh;
use orator_formats::mocap::captured::{self, MotionKind};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

fn reference() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/reference/bvh_take.bvh")
}

fn animate(dir: &Path, args: &str) -> (i32, Value, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator"));
    let args = format!("--json animate {args} --smoothing none --no-constraints");
    let output = command.args(args.split_whitespace()).current_dir(dir).output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    let printed = String::from_utf8_lossy(&output.stdout).into_owned() + &errors;
    (output.status.code().unwrap_or(-1), serde_json::from_slice(&output.stdout).unwrap_or_default(), printed)
}

#[test]
fn deviations_of_other_programs_are_read_and_noted() {
    let dir = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(reference()).unwrap();
    let positions = |path: &Path| Bvh::read(path).unwrap().positions(Positions::Auto);
    let original = positions(&reference());
    let (before, after) = text.split_once("Hips").unwrap();
    let thirty = (30, 1);
    for (name, bytes, n_frames, (num, den), expected) in [
        ("more", text.replace("Frames: 9", "Frames: 8").into_bytes(), 9, thirty, "states 8 frames, the file has 9"),
        ("fewer", text.replace("Frames: 9", "Frames: 10").into_bytes(), 9, thirty, "states 10 frames, the file has 9"),
        ("cut", text.as_bytes()[..text.len() - 30].to_vec(), 8, thirty, "is incomplete"),
        ("rounded", text.replace("0.0333333", "0.017").into_bytes(), 9, (60, 1), "0.017 is rounded: read as 60 fps"),
        ("exact", text.replace("0.0333333", "0.00834167").into_bytes(), 9, (120_000, 1001), ""),
        ("marked", format!("\u{feff}{}", text.replace('\n', "\r\n")).into_bytes(), 9, thirty, ""),
        ("latin", [before.as_bytes(), b"H\xfcfte", after.as_bytes()].concat(), 9, thirty, "the text is not UTF-8"),
    ] {
        let path = dir.path().join(format!("{name}.bvh"));
        std::fs::write(&path, bytes).unwrap();
        let take = captured::read(MotionKind::Bvh, &path).unwrap();
        assert_eq!(positions(&path), original[..n_frames], "{name}");
        assert_eq!((take.motion.n_frames(), take.motion.fps), (n_frames, FrameRate::new(num, den)), "{name}");
        let notes = bvh::notes(&take.facts).join("; ");
        assert!(notes.contains(expected) && notes.is_empty() == expected.is_empty(), "{name}: {notes}");
        let (code, json, printed) = animate(dir.path(), &format!("{name}.bvh --out {name}.npz"));
        assert_eq!((code, json["n_frames"].as_u64()), (0, Some(n_frames as u64)), "{printed}");
        assert!(json["notes"].to_string().contains(expected), "{printed}");
    }
    std::fs::write(dir.path().join("bad.bvh"), text.replacen("OFFSET 3 8 1", "OFFSET 3 8", 1)).unwrap();
    let (code, _, printed) = animate(dir.path(), "bad.bvh --out bad.npz");
    assert!(code != 0 && printed.contains("bad.bvh is not a valid BVH file: line 31: found `CHANNELS`"), "{printed}");
}

/// The reference take at half its size.
fn half_size() -> String {
    let half = |values: &str| {
        let values = values.split(' ').map(|value| (value.parse::<f64>().unwrap() / 2.0).to_string());
        values.collect::<Vec<_>>().join(" ")
    };
    let line = |line: &str| match line.split_once("OFFSET ") {
        Some((indent, offset)) => format!("{indent}OFFSET {}\n", half(offset)),
        None if line.starts_with(|c: char| c.is_ascii_digit() || c == '-') => {
            let at = line.match_indices(' ').nth(2).unwrap().0;
            format!("{}{}\n", half(&line[..at]), &line[at..])
        }
        None => format!("{line}\n"),
    };
    std::fs::read_to_string(reference()).unwrap().lines().map(line).collect()
}

#[test]
fn a_given_unit_replaces_the_detected_one() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("child.bvh");
    std::fs::write(&path, half_size()).unwrap();
    let detected = captured::read(MotionKind::Bvh, &path).unwrap();
    assert_eq!(detected.facts["source_unit"], "inch");
    let original = captured::read(MotionKind::Bvh, &reference()).unwrap().motion.joints;
    let units = Some("cm".parse().unwrap());
    let given = captured::read_in(MotionKind::Bvh, &path, units).unwrap();
    assert!(given.motion.joints.iter().zip(&original).all(|(a, b)| (a - b / 2.0).abs() < 1e-5));
    assert_eq!(bvh::notes(&given.facts), [""; 0]);

    let limits =
        TakeLimits { fps: FrameRate::new(15, 1), min_frames: 1, max_difference_secs: 60.0, no_sound: true, units };
    let files = TakeFiles {
        kind: MotionKind::Bvh,
        motion: path,
        sound: None,
        transcripts: Vec::new(),
        genea: None,
        origin: None,
    };
    let TakeOutcome::Accepted(accepted) = ImportedTake::read(&files, &limits, "host").unwrap().outcome else {
        panic!()
    };
    assert_eq!(accepted.sample.meta["imported"]["source_unit"], "centimetre");

    let noted = |args: &str| animate(dir.path(), args).1["notes"].to_string();
    assert!(noted("child.bvh --out a.npz").contains("the unit is the inch"));
    assert!(!noted("child.bvh --units cm --out a.npz").contains("unit"));
    for (args, expected) in [
        ("child.bvh --units feet --out a.npz", "expected one of m, cm, mm, inch"),
        ("child.bvh --units mm --out a.npz", "its arm bones are"),
        ("a.npz --units cm --out b.npz", "a.npz: --units applies to .bvh files"),
    ] {
        let (code, _, printed) = animate(dir.path(), args);
        assert!(code != 0 && printed.contains(expected), "{args}: {printed}");
    }
}

#[test]
fn a_forearm_without_a_hand_ends_at_the_wrist() {
    let arm = |side: &str, sign: f64| {
        format!(
            "JOINT {side}Arm\n{{\nOFFSET {} 45 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nJOINT {side}ForeArm\n{{\n\
             OFFSET {} 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{{\nOFFSET {} 0 0\n}}\n}}\n}}\n",
            18.0 * sign,
            29.0 * sign,
            24.0 * sign
        )
    };
    let text = format!(
        "HIERARCHY\nROOT Hips\n{{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nJOINT Neck\n{{\n\
         OFFSET 0 50 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{{\nOFFSET 0 20 0\n}}\n}}\n{}{}}}\n\
         MOTION\nFrames: 2\nFrame Time: 0.0333333\n{}\n{}\n",
        arm("Left", 1.0),
        arm("Right", -1.0),
        ["0"; 18].join(" "),
        ["0"; 18].join(" ")
    );
    let take = bvh::from_text(&text).unwrap();
    let joints = &take.motion.joints;
    for (elbow, wrist) in [(L_ELBOW, L_WRIST), (R_ELBOW, R_WRIST), (L_ELBOW, L_HAND)] {
        let square = |k: usize| f64::from(joints[[1, wrist, k]] - joints[[1, elbow, k]]).powi(2);
        let metres = (0..3).map(square).sum::<f64>().sqrt();
        assert!((metres - 0.24).abs() < 1e-6 && take.motion.mask[[1, wrist]], "{metres} m");
    }
    assert!(take.motion.mask[[0, L_WRIST]] && !take.motion.mask[[0, L_HAND + 1]]);
}
