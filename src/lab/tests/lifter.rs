//! `orator-lab evaluate lifter`: the error table, on motion with known truth.

use orator_dataset::config;
use orator_lab::evaluate::lifter::bodies::{BodyRow, Lifters, table, text};
use orator_lab::mocap::upper_body;
use orator_lab::mocap::upper_body::{BodyTake, Set};
use orator_lab::train::scene::body_motion::gesture;
use orator_test_support::skip::real_data;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::process::Command;

/// Procedural gestures, as takes of 8 s.
fn procedural() -> Set {
    let take = |seed: u64| {
        let poses = gesture(&mut ChaCha8Rng::seed_from_u64(seed), 240, 1.0 / 30.0);
        BodyTake { name: format!("rule#{seed}"), fps: 30.0, poses, rendered: false }
    };
    ("procedural".to_owned(), (900..908).map(take).collect())
}

fn mpjpe(rows: &[BodyRow], method: &str, input: &str) -> f64 {
    rows.iter().find(|row| row.method == method && row.input == input).unwrap().errors.mpjpe
}

#[test]
fn the_lifter_beats_what_needs_no_network() {
    let lifters = Lifters::new(&config::LiftConfig::default()).unwrap();
    let rows = table(&lifters, &[procedural()], 16).unwrap();
    eprintln!("{}", text(&rows));
    let lifted = mpjpe(&rows, "orator lift", "drop");
    for baseline in ["bone-length depth", "mean depth per joint", "constant mean pose"] {
        assert!(lifted < 0.8 * mpjpe(&rows, baseline, "clean"), "{}", text(&rows));
    }
    assert!(rows.iter().all(|row| row.complete_share > 0.97 && row.by_yaw.len() == 3));
    assert_eq!(text(&rows), text(&table(&lifters, &[procedural()], 16).unwrap()), "the same scenes each time");
}

/// Targets for clips of TED speakers, which are in no training set.
#[test]
fn ted_speakers_are_lifted_within_the_targets() {
    let Some(folder) = real_data("data/speech_motion/ted_expressive") else { return };
    let sets = [("TED".to_owned(), upper_body::read_all(&[folder]).unwrap())];
    let rows = table(&Lifters::new(&config::LiftConfig::default()).unwrap(), &sets, 56).unwrap();
    eprintln!("{}", text(&rows));
    let lifted = &rows[0].errors;
    assert!(lifted.mpjpe <= 50.0 && lifted.p_mpjpe <= 30.0 && lifted.wrist <= 79.0, "{lifted}");
    assert!(lifted.wrist_velocity <= 24.0, "{lifted}");
}

#[test]
fn errors_of_files_without_motion_name_the_file() {
    let dir = tempfile::tempdir().unwrap();
    let error = |name: &str, bytes: &[u8]| {
        let path = dir.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_orator-lab"));
        let output = command.args(["evaluate", "lifter", "--mocap"]).arg(&path).output().unwrap();
        assert_eq!(output.status.code(), Some(1));
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(text.contains(name) && !text.contains("panicked"), "{text}");
        text
    };
    assert!(error("cut.bvh", b"HIERARCHY ROOT Hips { OFFSET 0 0").contains("unexpected end of file"));
    let strange = b"HIERARCHY ROOT a { OFFSET 0 0 0 CHANNELS 0 } MOTION Frames: 0 Frame Time: 0.1";
    assert!(error("strange.bvh", strange).contains("LeftForeArm"));
    error("empty.npz", b"");
    error("motion.fbx", b"x");
}
