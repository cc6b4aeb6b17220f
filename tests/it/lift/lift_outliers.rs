//! Frames that lifting rejects after segmentation: implausible bone lengths and gaps too long to fill. The ledger and
//! the intervals are updated accordingly.

use crate::fixtures::footage::{FPS, Footage, good, write};
use ndarray::s;
use orator_base::stage::artifacts::{self, StageName};
use orator_base::stage::ledger::Ledger;
use orator_base::stage::progress::Silent;
use orator_base::stage::{Stage, Unit};
use orator_base::types::interval::Intervals;
use orator_base::types::pose2d::coco;
use orator_base::types::pose3d::Motion;
use orator_base::types::skeleton::{L_WRIST, R_WRIST};
use orator_dataset::config;
use orator_formats::joints_npz;
use orator_pipeline::lift::LiftStage;
use orator_pipeline::segment::SegmentStage;

/// Runs `segment` and `lift`; returns intervals, ledger, joints and the report of `lift`.
fn reported(footage: &Footage) -> (Vec<(usize, usize)>, Ledger, Motion, String) {
    let dir = tempfile::tempdir().unwrap();
    let work = dir.path().join("work");
    let unit = Unit { speaker: "host".into(), video: "talk-00000000".into(), source: dir.path().join("talk.mp4") };
    write(&work, &unit, footage, "a");
    let rules = config::SegmentConfig::default();
    let segment = SegmentStage::new(&rules, &work);
    let lift = LiftStage::new(&config::LiftConfig::default(), &rules, &work).unwrap();
    let run = |stage: &dyn Stage| {
        let out = unit.dir(&work.join(stage.name()));
        std::fs::create_dir_all(&out).unwrap();
        stage.run(&unit, &out, &Silent).unwrap().line
    };
    run(&segment);
    let line = run(&lift);
    let out = artifacts::dir(&work, StageName::Lift, &unit);
    let intervals: Intervals = serde_json::from_slice(&std::fs::read(out.join("intervals.json")).unwrap()).unwrap();
    let ledger = Ledger::read(&out.join("ledger.json")).unwrap();
    assert_eq!(ledger.accepted.len(), intervals.intervals.len());
    let motion = joints_npz::read(&out.join("joints.npz")).unwrap();
    let is_accepted = |t: usize| intervals.intervals.iter().any(|i| (i.start..i.end).contains(&t));
    for (t, joints) in motion.joints.outer_iter().enumerate() {
        assert!(joints.iter().all(|v| v.is_finite() == is_accepted(t)), "frame {t}");
    }
    (intervals.intervals.iter().map(|i| (i.start, i.end)).collect(), ledger, motion, line)
}

fn lifted(footage: &Footage) -> (Vec<(usize, usize)>, Ledger, Motion) {
    let (intervals, ledger, motion, line) = reported(footage);
    assert_eq!(line.contains("rejected"), !ledger.rejected.is_empty(), "{line}");
    (intervals, ledger, motion)
}

/// Stretches the left forearm far beyond its length, and moves its hand along.
fn stretch_arm(footage: &mut Footage, frames: std::ops::Range<usize>) {
    footage.keypoints.body.slice_mut(s![frames.clone(), coco::L_WRIST, 0]).mapv_inplace(|x| x + 400.0);
    footage.keypoints.left_hand.slice_mut(s![frames, .., 0]).mapv_inplace(|x| x + 400.0);
}

#[test]
fn a_good_video_is_accepted_completely() {
    let (intervals, ledger, _) = lifted(&good(200));
    assert_eq!(intervals, [(0, 200)]);
    assert!(ledger.rejected.is_empty());
}

#[test]
fn implausible_bone_lengths_are_rejected_and_short_errors_filled() {
    let mut footage = good(300);
    stretch_arm(&mut footage, 100..130);
    let (intervals, ledger, _) = lifted(&footage);
    let (bones, others): (Vec<_>, Vec<_>) = ledger.rejected.iter().partition(|r| r.reason == "bones");
    assert!(others.is_empty() && bones.len() == 1 && intervals.len() == 2, "{ledger:?}");
    let bones = bones[0];
    assert!((bones.start_secs - FPS.secs(100)).abs() < 0.15 && (bones.end_secs - FPS.secs(130)).abs() < 0.15);
    assert!(bones.measured > bones.threshold && bones.unit == "bone lengths" && bones.message.contains("bone"));

    let mut footage = good(200);
    footage.keypoints.left_hand.slice_mut(s![99..105, .., ..]).fill(0.0);
    stretch_arm(&mut footage, 100..104);
    let (intervals, _, motion) = lifted(&footage);
    assert_eq!(intervals, [(0, 200)]);
    assert!((100..104).all(|t| !motion.mask[[t, L_WRIST]] && motion.mask[[t, R_WRIST]]));
    let x = |t: usize| motion.joints[[t, L_WRIST, 0]];
    assert!((x(102) - x(95)).abs() < 0.1, "{} {}", x(102), x(95));
}

#[test]
fn adjacent_gaps_longer_than_lifting_fills_are_rejected() {
    let mut footage = good(300);
    // Each gap alone is accepted: first the score of all its points, then single points.
    footage.keypoints.left_hand.slice_mut(s![100..112, .., 2]).fill(0.0);
    footage.keypoints.left_hand.slice_mut(s![112..124, ..12, 2]).fill(0.0);
    let (intervals, ledger, _, line) = reported(&footage);
    assert_eq!(intervals, [(0, 100), (124, 300)], "{ledger:?}");
    assert!(line.ends_with("; 1.6 s of 20.0 s rejected: missing joints 1.6 s"), "{line}");
    assert_eq!(ledger.rejected[0].reason, "open");
    assert!(ledger.rejected[0].message.starts_with("21 of the joints"), "{}", ledger.rejected[0].message);
}
