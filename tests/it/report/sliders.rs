//! For a change of every threshold, the seconds that a slider of the report predicts as accepted are those that
//! `segment` and `lift` accept when run with it.

use crate::fixtures::footage::{Footage, good, write};
use ndarray::s;
use orator_base::stage::artifacts::Artifact;
use orator_base::stage::ledger::Ledger;
use orator_base::stage::progress::Silent;
use orator_base::stage::{Stage, Unit};
use orator_base::types::pose2d::coco;
use orator_dataset::config::{self, SegmentConfig};
use orator_formats::media_json::MediaInfo;
use orator_formats::npz::Npz;
use orator_pipeline::lift::LiftStage;
use orator_pipeline::segment::{Measures, SegmentStage};
use orator_report::videos::sliders::{JudgedVideo, open_frames};
use orator_report::videos::thresholds::THRESHOLDS;
use std::path::Path;

/// Half a minute with a cut, a small step aside, a quiet part, a hand that is out of frame for a while, and a wrist
/// that is detected far away for 20 frames.
fn footage() -> Footage {
    let mut footage = good(450);
    footage.shot[130..].fill(1);
    footage.keypoints.body.slice_mut(s![220.., .., 0]).mapv_inplace(|x| x + 40.0);
    footage.keypoints.right_hand.slice_mut(s![30..42, .., 2]).fill(0.0);
    let wrist = 340..360;
    footage.keypoints.body.slice_mut(s![wrist.clone(), coco::L_WRIST, 0]).mapv_inplace(|x| x + 400.0);
    footage.keypoints.left_hand.slice_mut(s![wrist, .., 0]).mapv_inplace(|x| x + 400.0);
    if let Some(sound) = &mut footage.sound {
        sound[250 * 1067..310 * 1067].iter_mut().for_each(|sample| *sample /= 500);
    }
    footage
}

/// Runs both stages; returns the ledger of `lift`.
fn run(work: &Path, unit: &Unit, rules: &SegmentConfig, lift: &config::LiftConfig) -> Ledger {
    let stages: [Box<dyn Stage>; 2] =
        [Box::new(SegmentStage::new(rules, work)), Box::new(LiftStage::new(lift, rules, work).unwrap())];
    for stage in stages {
        let out = unit.dir(&work.join(stage.name()));
        std::fs::create_dir_all(&out).unwrap();
        stage.run(unit, &out, &Silent).unwrap();
    }
    Ledger::read(&Artifact::LiftLedger.path(work, unit)).unwrap()
}

#[test]
fn a_slider_predicts_the_accepted_seconds_of_a_run() {
    let dir = tempfile::tempdir().unwrap();
    let unit = Unit { speaker: "host".into(), video: "talk-00000000".into(), source: dir.path().join("talk.mp4") };
    write(dir.path(), &unit, &footage(), "a");
    let (rules, lift) = (SegmentConfig::default(), config::LiftConfig::default());
    let now = run(dir.path(), &unit, &rules, &lift);
    assert!(now.rejected_secs().contains_key("bones"), "{now:?}");

    let video = MediaInfo::read(&Artifact::MediaInfo.path(dir.path(), &unit)).unwrap();
    let measures = Measures::read(&Artifact::Measures.path(dir.path(), &unit)).unwrap();
    let bone_change = Npz::open(&Artifact::BoneChange.path(dir.path(), &unit)).unwrap();
    let bone_change: Vec<f32> = { bone_change }.floats("bone_change", &[None]).unwrap().into_iter().collect();
    let open = open_frames(&now, &video);
    let judged = |max_bone_change| JudgedVideo {
        measures: &measures,
        video: &video,
        bone_change: &bone_change,
        max_bone_change,
        open: &open,
        decisions: &[],
    };
    assert!((judged(lift.max_bone_change).accepted_secs(&rules) - now.accepted_secs()).abs() < 1e-3);

    let mut n_changed = 0;
    let mut compare = |key: &str, value: f64, rules: &SegmentConfig, lift: &config::LiftConfig| {
        let (slider, again) = (judged(lift.max_bone_change).accepted_secs(rules), run(dir.path(), &unit, rules, lift));
        let accepted = again.accepted_secs();
        assert!((slider - accepted).abs() < 1e-3, "{key} = {value}: predicted {slider} s, accepted {accepted} s");
        n_changed += usize::from((accepted - now.accepted_secs()).abs() > 1e-3);
    };
    for threshold in &THRESHOLDS {
        let (grid, _) = threshold.grid(&rules);
        for value in [grid[5], grid[15]] {
            compare(threshold.key, value, &threshold.with(&rules, value), &lift);
        }
    }
    for max_bone_change in [0.2, 2.0] {
        compare("max_bone_change", max_bone_change, &rules, &config::LiftConfig { max_bone_change, ..lift.clone() });
    }
    assert!(n_changed >= 6, "only {n_changed} of the changes have an effect");
}
