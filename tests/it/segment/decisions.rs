//! Frames that users accept or reject override the rules of the stage `segment`.

use crate::dataset::decisions::decision;
use crate::fixtures::footage::{FPS, good, write};
use ndarray::s;
use orator_base::stage::fingerprint::{Fingerprint, HashCache};
use orator_base::stage::ledger::Ledger;
use orator_base::stage::progress::Silent;
use orator_base::stage::{Stage, Unit};
use orator_base::types::interval::{Interval, Intervals};
use orator_dataset::config::{LiftConfig, SegmentConfig};
use orator_dataset::decisions::{Decision, DecisionAction};
use orator_formats::media_json::MediaInfo;
use orator_pipeline::lift::LiftStage;
use orator_pipeline::segment::{Measures, SegmentStage, judge};
use std::fs;

fn at(action: DecisionAction, frames: std::ops::Range<usize>) -> Decision {
    decision("talk-00000000", action, (FPS.secs(frames.start), FPS.secs(frames.end)))
}

fn reject(frames: std::ops::Range<usize>) -> Decision {
    at(DecisionAction::Reject, frames)
}

fn accept(frames: std::ops::Range<usize>) -> Decision {
    at(DecisionAction::Accept, frames)
}

/// Measures of 300 good frames.
fn measures() -> Measures {
    Measures::from_keypoints(&good(300).keypoints)
}

fn judged(measures: &Measures, decisions: &[Decision]) -> (Intervals, Ledger) {
    let video = MediaInfo::new(FPS.secs(300) - 0.01, 300, FPS);
    let (intervals, ledger) = judge(measures, &video, &SegmentConfig::default(), &decisions.iter().collect::<Vec<_>>());
    assert!(ledger.is_complete() && ledger.accepted.len() == intervals.intervals.len(), "{ledger:?}");
    (intervals, ledger)
}

fn accepted(measures: &Measures, decisions: &[Decision]) -> Vec<(usize, usize)> {
    judged(measures, decisions).0.intervals.into_iter().map(|Interval { start, end }| (start, end)).collect()
}

fn reasons(ledger: &Ledger) -> Vec<(&str, &str)> {
    ledger.rejected.iter().map(|one| (one.reason.as_str(), one.message.as_str())).collect()
}

#[test]
fn rejected_frames_are_in_the_ledger_with_their_author() {
    let measures = measures();
    assert_eq!(accepted(&measures, &[]), [(0, 300)]);
    let ben = Decision { author: "ben".to_owned(), ..reject(120..150) };
    let none = Decision { author: String::new(), ..reject(280..300) };
    let (intervals, ledger) = judged(&measures, &[reject(100..120), ben, none]);
    assert_eq!(intervals.intervals.len(), 2);
    let expected = [
        ("rejected by hand", "rejected by hand (ana)"),
        ("rejected by hand", "rejected by hand (ben)"),
        ("rejected by hand", "rejected by hand"),
    ];
    assert_eq!(reasons(&ledger), expected);
    let first = &ledger.rejected[0];
    assert!((first.measured - 20.0 / 15.0).abs() < 1e-9 && first.unit == "s", "{first:?}");
    // What remains beside a rejected range can be too short.
    let (_, ledger) = judged(&measures, &[reject(30..100)]);
    assert_eq!(
        reasons(&ledger).iter().map(|(reason, _)| *reason).collect::<Vec<_>>(),
        ["too short", "rejected by hand"]
    );
    // The range reaches beyond the video.
    assert_eq!(accepted(&measures, &[reject(200..10_000)]), [(0, 200)]);
    assert_eq!(accepted(&measures, &[reject(400..500)]), [(0, 300)]);
}

#[test]
fn accepted_frames_are_exempt_from_the_rules_but_not_from_cuts() {
    let mut quiet = measures();
    quiet.sound_db[100..200].fill(-80.0);
    assert_eq!(accepted(&quiet, &[]), [(0, 100), (200, 300)]);
    assert_eq!(accepted(&quiet, &[accept(100..200)]), [(0, 300)]);
    assert_eq!(accepted(&quiet, &[accept(120..130)]), [(0, 100), (120, 130), (200, 300)], "no minimum length");
    quiet.shot_score[150] = 1.0;
    assert_eq!(accepted(&quiet, &[accept(100..200)]), [(0, 150), (150, 300)]);

    // A rule on segments, and the minimum length.
    let mut crowd = measures();
    crowd.n_persons[0..300].fill(9.0);
    assert_eq!(accepted(&crowd, &[]), []);
    assert_eq!(accepted(&crowd, &[accept(0..300)]), [(0, 300)]);
    assert_eq!(accepted(&crowd, &[accept(50..150)]), [(50, 150)], "a part of a piece");
    let (_, ledger) = judged(&crowd, &[accept(50..150)]);
    assert_eq!(reasons(&ledger).iter().map(|(reason, _)| *reason).collect::<Vec<_>>(), ["crowd", "crowd"]);
    let mut short = measures();
    short.shot_score[40] = 1.0;
    assert_eq!(accepted(&short, &[]), [(40, 300)]);
    assert_eq!(accepted(&short, &[accept(0..40)]), [(0, 40), (40, 300)]);
}

#[test]
fn frames_without_a_person_stay_rejected_for_that_reason() {
    let mut measures = measures();
    measures.person[100..200].fill(0.0);
    measures.sound_db[50..250].fill(-80.0);
    let (intervals, ledger) = judged(&measures, &[accept(0..300)]);
    let expected = [Interval { start: 0, end: 100 }, Interval { start: 200, end: 300 }];
    assert_eq!(intervals.intervals, expected);
    assert_eq!(reasons(&ledger)[0].0, "no person");
    assert_eq!(ledger.rejected.len(), 1);
}

#[test]
fn later_decisions_win_and_removed_ones_leave_no_trace() {
    let mut measures = measures();
    measures.sound_db[100..200].fill(-80.0);
    assert_eq!(accepted(&measures, &[accept(0..300), reject(100..150)]), [(0, 100), (150, 300)]);
    assert_eq!(accepted(&measures, &[reject(100..150), accept(0..300)]), [(0, 300)]);
    let other = [at(DecisionAction::SwapHands, 0..300), at(DecisionAction::Word, 0..300)];
    assert_eq!(judged(&measures, &other), judged(&measures, &[]));
}

#[test]
fn only_units_with_decisions_become_stale_and_undoing_restores_every_byte() {
    let dir = tempfile::tempdir().unwrap();
    let work = dir.path().join("work");
    let unit = |name: &str| Unit {
        speaker: "host".into(),
        video: format!("{name}-00000000"),
        source: dir.path().join(format!("videos/{name}.mp4")),
    };
    let (talk, other) = (unit("talk"), unit("other"));
    let mut footage = good(200);
    footage.keypoints.left_hand.slice_mut(s![90..120, .., ..]).fill(0.0);
    for unit in [&talk, &other] {
        write(&work, unit, &footage, "a");
    }
    let stage =
        |decisions: &[Decision]| SegmentStage::new(&SegmentConfig::default(), &work).with_decisions(decisions.to_vec());
    let decided = [accept(80..130), reject(0..10), at(DecisionAction::SwapHands, 100..110)];
    let hashes = HashCache::open(&dir.path().join("hashes.json"));
    let key = |stage: &dyn Stage, unit: &Unit| Fingerprint::now(stage, unit, &hashes).unwrap();
    let bytes = |key: &Fingerprint| serde_json::to_string(key).unwrap();
    assert_eq!(bytes(&key(&stage(&decided), &other)), bytes(&key(&stage(&[]), &other)));
    assert_ne!(key(&stage(&decided), &talk), key(&stage(&[]), &talk));
    let lift = |decisions: &[Decision]| {
        LiftStage::new(&LiftConfig::default(), &SegmentConfig::default(), &work)
            .unwrap()
            .with_decisions(decisions.to_vec())
    };
    let lift_settings = |decisions: &[Decision], unit: &Unit| lift(decisions).settings(unit).to_string();
    assert_eq!(lift_settings(&decided[..2], &talk), lift_settings(&[], &talk), "only swaps change the lifting");
    assert_eq!(lift_settings(&decided, &other), lift_settings(&[], &other));
    assert_ne!(lift_settings(&decided, &talk), lift_settings(&[], &talk));
    // Speaker and word do not concern this stage.
    let word = Decision { text: Some("a".into()), ..at(DecisionAction::Word, 0..10) };
    assert_eq!(key(&stage(&[word]), &talk), key(&stage(&[]), &talk));

    let run = |decisions: &[Decision], name: &str| {
        let out = dir.path().join(name);
        fs::create_dir_all(&out).unwrap();
        let line = stage(decisions).run(&talk, &out, &Silent).unwrap().line;
        let files = ["intervals.json", "ledger.json", "measures.npz"].map(|file| fs::read(out.join(file)).unwrap());
        (line, files)
    };
    let before = run(&[], "before");
    let (line, files) = run(&decided, "decided");
    assert!(line.ends_with("; decided by hand: 1 accept (ana), 1 reject (ana), 1 swap-hands (ana)"), "{line}");
    let ledger: Ledger = serde_json::from_slice(&files[1]).unwrap();
    assert_eq!((ledger.accepted.len(), ledger.rejected.len()), (1, 1), "{ledger:?}");
    assert_eq!(run(&[], "undone"), before);
    assert_ne!(files[2], before.1[2], "measures of exchanged hands");
}
