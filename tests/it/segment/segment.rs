//! Rules of segmentation: every reason of rejection, gaps that are accepted, and that all seconds are accounted for.

use crate::fixtures::footage::{FPS, Footage, good, write};
use ndarray::s;
use orator_base::stage::ledger::Ledger;
use orator_base::stage::progress::Silent;
use orator_base::stage::rejection::Rejection;
use orator_base::stage::{Stage, Unit};
use orator_base::types::interval::{Interval, Intervals};
use orator_base::types::pose2d::{Keypoints, coco};
use orator_dataset::config;
use orator_formats::media_json::MediaInfo;
use orator_pipeline::segment::{Measures, SegmentStage, judge};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Measures as the stage computes them, but with a constant sound level.
fn measures(footage: &Footage) -> Measures {
    let mut measures = Measures::from_keypoints(&footage.keypoints);
    let n_frames = footage.shot.len();
    let sound = footage.sound.clone().unwrap_or_default();
    let secs = sound.len() as f64 / 16_000.0;
    let peak = sound.iter().map(|s| s.unsigned_abs()).max().unwrap_or(0);
    measures.sound = (0..n_frames).map(|t| f32::from(u8::from(FPS.secs(t) < secs))).collect();
    measures.sound_db = vec![20.0 * f32::from(peak.max(1)).log10() - 90.3; n_frames];
    for t in 1..n_frames {
        measures.shot_score[t] = f32::from(u8::from(footage.shot[t] != footage.shot[t - 1]));
    }
    measures
}

fn judged_measures(measures: &Measures, duration_secs: f64) -> (Intervals, Ledger) {
    let video = MediaInfo::new(duration_secs, measures.n_frames(), FPS);
    judge(measures, &video, &config::SegmentConfig::default(), &[])
}

fn judged(footage: &Footage) -> (Intervals, Ledger) {
    judged_measures(&measures(footage), footage.duration_secs)
}

/// Accepted intervals, and the reasons of rejection in order of time.
fn verdict(footage: &Footage) -> (Vec<(usize, usize)>, Vec<String>) {
    let (intervals, ledger) = judged(footage);
    assert!(ledger.is_complete());
    for rejected in &ledger.rejected {
        assert!(rejected.measured.is_finite() && rejected.message.len() > 20, "{rejected:?}");
    }
    let intervals = intervals.intervals.iter().map(|i| (i.start, i.end)).collect();
    (intervals, ledger.rejected.iter().map(|r| r.reason.clone()).collect())
}

fn is_fully_accepted(footage: &Footage) -> bool {
    verdict(footage) == (vec![(0, footage.shot.len())], vec![])
}

fn hide(keypoints: &mut Keypoints, joints: &[usize], frames: std::ops::Range<usize>) {
    for &joint in joints {
        keypoints.body.slice_mut(s![frames.clone(), joint, 2]).fill(0.1);
    }
}

#[test]
fn a_good_video_is_accepted_completely_and_its_windows_counted() {
    assert!(is_fully_accepted(&good(200)));
    let (intervals, ledger) = judged(&good(200));
    assert_eq!((intervals.windows_64.stride_5, intervals.windows_64.disjoint), (28, 3));
    assert_eq!(ledger.accepted_secs(), 200.0 / 15.0);
    let (read, path) = (measures(&good(200)), tempfile::tempdir().unwrap().keep().join("measures.npz"));
    read.write(&path).unwrap();
    assert_eq!(Measures::read(&path).unwrap(), read);
    std::fs::remove_dir_all(path.parent().unwrap()).unwrap();
}

#[test]
fn short_gaps_are_accepted_and_longer_ones_rejected() {
    let mut footage = good(200);
    hide(&mut footage.keypoints, &[coco::L_ELBOW], 50..55);
    footage.keypoints.left_hand.slice_mut(s![80..95, .., ..]).fill(0.0);
    footage.keypoints.right_hand.slice_mut(s![185..200, .., ..]).fill(0.0);
    assert!(is_fully_accepted(&footage));
    hide(&mut footage.keypoints, &[coco::L_ELBOW], 50..56);
    assert_eq!(verdict(&footage), (vec![(56, 200)], vec!["too short".into(), "arms".into()]));
    footage.keypoints.left_hand.slice_mut(s![80..96, .., ..]).fill(0.0);
    let (intervals, reasons) = verdict(&footage);
    assert_eq!(intervals, [(96, 200)]);
    assert_eq!(reasons, ["too short", "arms", "too short", "hands"]);
    // A gap at the start or end of the video cannot be interpolated.
    let mut footage = good(100);
    hide(&mut footage.keypoints, &[coco::NOSE], 0..2);
    assert_eq!(verdict(&footage), (vec![(2, 100)], vec!["face".into()]));
}

#[test]
fn every_reason_is_found() {
    let rejected = |change: &dyn Fn(&mut Footage)| {
        let mut footage = good(100);
        change(&mut footage);
        let (intervals, reasons) = verdict(&footage);
        assert!(intervals.is_empty(), "{reasons:?}");
        reasons.join(" ")
    };
    assert_eq!(rejected(&|f| f.sound = None), "no sound");
    assert_eq!(rejected(&|f| f.sound = Some(vec![])), "no sound");
    assert_eq!(rejected(&|f| f.sound = Some(vec![3; 106_667])), "quiet");
    assert_eq!(rejected(&|f| f.keypoints.body.fill(0.0)), "no person");
    assert_eq!(rejected(&|f| f.keypoints.body.slice_mut(s![.., .., ..2]).mapv_inplace(|v| v * 0.3)), "too small");
    assert_eq!(rejected(&|f| hide(&mut f.keypoints, &[coco::L_EYE, coco::R_EYE], 0..100)), "face");
    assert_eq!(rejected(&|f| hide(&mut f.keypoints, &[coco::R_ELBOW], 0..100)), "arms");
    // As in the clip talk_kim, where the image ends above the wrists.
    let no_hands = |f: &mut Footage| {
        hide(&mut f.keypoints, &[coco::L_WRIST, coco::R_WRIST, coco::L_HIP, coco::R_HIP], 0..100);
        f.keypoints.left_hand.fill(0.0);
        f.keypoints.right_hand.fill(0.0);
    };
    assert_eq!(rejected(&no_hands), "hands");
    // Only short gaps, but detected in too few frames.
    let seldom = |f: &mut Footage| {
        (0..100).filter(|t| t % 3 != 0).for_each(|t| f.keypoints.left_hand.slice_mut(s![t, .., ..]).fill(0.0));
    };
    assert_eq!(rejected(&seldom), "hands");
    assert_eq!(rejected(&|f| f.shot[50..].fill(1)), "cut cut");
    assert_eq!(rejected(&|f| *f = good(63)), "too short");
    let jump = |f: &mut Footage| f.keypoints.body.slice_mut(s![50.., .., 0]).mapv_inplace(|x| x + 70.0);
    assert_eq!(rejected(&jump), "too short jump too short");
    assert_eq!(rejected(&|f| *f = good(0)), "");
}

/// Judges the measures of 200 good frames after `change`: accepted intervals, and reasons in order of time.
fn judged_with(change: impl Fn(&mut Measures)) -> (Vec<(usize, usize)>, Vec<String>) {
    let mut measures = measures(&good(200));
    change(&mut measures);
    let (intervals, ledger) = judged_measures(&measures, 200.0 / 15.0);
    assert!(ledger.is_complete());
    let accepted = intervals.intervals.iter().map(|i| (i.start, i.end)).collect();
    (accepted, ledger.rejected.into_iter().map(|r| r.reason).collect())
}

#[test]
fn gaps_where_the_other_hand_was_detected_have_their_own_reason() {
    let gap = |measures: &mut Measures, share: f32| {
        measures.left_hand[70..100].fill(0.0);
        measures.left_other[70..100].fill(share);
    };
    let accepted = vec![(0, 70), (100, 200)];
    assert_eq!(judged_with(|m| gap(m, 0.5)), (accepted.clone(), vec!["other hand".into()]));
    assert_eq!(judged_with(|m| gap(m, 0.2)), (accepted, vec!["hands".into()]));
}

#[test]
fn hands_that_rest_on_each_other_may_occlude_each_other() {
    let mut measures = measures(&good(200));
    measures.left_hand[20..180].fill(0.0);
    measures.rest[18..170].fill(0.05);
    let (intervals, ledger) = judged_measures(&measures, 200.0 / 15.0);
    assert_eq!(intervals.intervals, [Interval { start: 0, end: 200 }], "the remaining ten frames are a short gap");
    assert_eq!(intervals.resting, [Interval { start: 18, end: 170 }]);
    assert!(ledger.is_complete() && (ledger.resting_secs() - 152.0 / 15.0).abs() < 1e-9);
    measures.rest[18..170].fill(0.15);
    let (intervals, ledger) = judged_measures(&measures, 200.0 / 15.0);
    assert!(intervals.intervals.is_empty() && intervals.resting.is_empty() && ledger.resting.is_empty());
}

#[test]
fn short_quiet_or_static_parts_are_accepted_and_longer_ones_rejected() {
    assert_eq!(judged_with(|m| m.sound_db[80..125].fill(-60.0)), (vec![(0, 200)], vec![]));
    assert_eq!(judged_with(|m| m.sound_db[80..126].fill(-60.0)), (vec![(0, 80), (126, 200)], vec!["quiet".into()]));
    assert_eq!(judged_with(|m| m.frame_difference[90..97].fill(0.0)), (vec![(0, 200)], vec![]));
    assert_eq!(judged_with(|m| m.frame_difference[90..98].fill(0.0)), (vec![(0, 90), (98, 200)], vec!["still".into()]));
    // A source of 10 fps resampled to 15 fps.
    assert_eq!(
        judged_with(|m| (0..200).filter(|t| t % 3 == 1).for_each(|t| m.frame_difference[t] = 0.0)),
        (vec![(0, 200)], vec![])
    );
}

#[test]
fn a_body_turned_away_is_rejected() {
    assert_eq!(judged_with(|m| m.facing[80..85].fill(0.2)), (vec![(0, 200)], vec![]));
    assert_eq!(
        judged_with(|m| {
            m.facing.fill(0.6);
            m.nose_off.fill(2.0);
        }),
        (vec![(0, 200)], vec![])
    );
    assert_eq!(judged_with(|m| m.facing[80..86].fill(0.2)), (vec![(0, 80), (86, 200)], vec!["turned".into()]));
    assert_eq!(judged_with(|m| m.facing[80..].fill(-2.0)), (vec![(0, 80)], vec!["turned".into()]));
    assert_eq!(judged_with(|m| m.nose_off[..120].fill(3.4)), (vec![(120, 200)], vec!["turned".into()]));
    assert_eq!(judged_with(|m| m.nose_off.fill(f32::NAN)), (vec![(0, 200)], vec![]));
}

#[test]
fn another_person_ends_the_interval_and_a_crowd_is_rejected() {
    assert_eq!(judged_with(|m| m.identity[90] = 1.0), (vec![(0, 90), (90, 200)], vec![]));
    assert_eq!(judged_with(|m| m.identity[30] = 1.0), (vec![(30, 200)], vec!["other person".into()]));
    assert_eq!(judged_with(|m| m.n_persons[..60].fill(9.0)), (vec![(0, 200)], vec![]));
    assert_eq!(judged_with(|m| m.n_persons[..61].fill(9.0)), (vec![], vec!["crowd".into()]));
}

#[test]
fn a_cut_splits_intervals_and_the_end_of_the_audio_ends_the_last() {
    let mut footage = good(300);
    footage.shot[100..].fill(1);
    assert_eq!(verdict(&footage), (vec![(0, 100), (100, 300)], vec![]));
    // The speaker may have another position after a cut.
    footage.keypoints.body.slice_mut(s![100.., .., 0]).mapv_inplace(|x| x + 150.0);
    assert_eq!(verdict(&footage), (vec![(0, 100), (100, 300)], vec![]));
    if let Some(sound) = &mut footage.sound {
        sound.truncate(16_000 * 15 + 1);
    }
    assert_eq!(verdict(&footage), (vec![(0, 100), (100, 226)], vec!["no sound".into()]));
}

#[test]
fn every_second_is_counted_exactly_once() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let rules = config::SegmentConfig::default();
    for _ in 0..400 {
        let n_frames = rng.random_range(1..500);
        let mut footage = good(n_frames);
        let joints = [coco::NOSE, coco::L_EYE, coco::L_SHOULDER, coco::R_ELBOW, coco::L_WRIST];
        for _ in 0..rng.random_range(0..12) {
            let start = rng.random_range(0..n_frames);
            let end = (start + rng.random_range(1..40)).min(n_frames);
            match rng.random_range(0..6) {
                0 => footage.keypoints.left_hand.slice_mut(s![start..end, .., ..]).fill(0.0),
                1 => footage.keypoints.right_hand.slice_mut(s![start..end, .., ..]).fill(0.0),
                2 => footage.shot[start..].iter_mut().for_each(|shot| *shot += 1),
                3 => footage.keypoints.body.slice_mut(s![start.., .., 0]).mapv_inplace(|x| x + 80.0),
                4 => footage.keypoints.body.slice_mut(s![start..end, .., ..]).fill(0.0),
                _ => hide(&mut footage.keypoints, &joints[rng.random_range(0..5)..][..1], start..end),
            }
        }
        footage.duration_secs -= rng.random_range(0.0..0.06);
        if rng.random_bool(0.3) {
            let n = rng.random_range(0..n_frames * 1_100);
            footage.sound.iter_mut().for_each(|sound| sound.truncate(n));
        }
        let (intervals, ledger) = judged(&footage);
        assert!(ledger.is_complete());
        let rejected: f64 = ledger.rejected_secs().values().sum();
        assert!((ledger.accepted_secs() + rejected - footage.duration_secs).abs() < 1e-9);
        assert_eq!(intervals.intervals.len(), ledger.accepted.len());
        for (&Interval { start, end }, accepted) in intervals.intervals.iter().zip(&ledger.accepted) {
            assert!(end - start >= rules.min_frames && end <= n_frames);
            assert!(footage.shot[start..end].iter().all(|&shot| shot == footage.shot[start]));
            assert_eq!(accepted.start_secs, FPS.secs(start));
            assert_eq!(accepted.end_secs, if end == n_frames { footage.duration_secs } else { FPS.secs(end) });
        }
        let text = serde_json::to_vec(&ledger).unwrap();
        assert!(serde_json::from_slice::<Ledger>(&text).unwrap().is_complete());
    }
    let reasons = Rejection::JUDGED.map(|rejection| rejection.message(1.0, 2.0));
    assert_eq!(reasons.iter().collect::<std::collections::BTreeSet<_>>().len(), Rejection::JUDGED.len());
}

#[test]
fn the_stage_reads_and_writes_its_files() {
    let dir = tempfile::tempdir().unwrap();
    let work = dir.path().join("work");
    let unit =
        Unit { speaker: "host".into(), video: "talk-00000000".into(), source: dir.path().join("videos/talk.mp4") };
    let mut footage = good(200);
    footage.keypoints.left_hand.slice_mut(s![90..120, .., ..]).fill(0.0);
    write(&work, &unit, &footage, "a");
    let stage = SegmentStage::new(&config::SegmentConfig::default(), &work);
    assert_eq!(stage.inputs(&unit).unwrap().len(), 4);
    let run = |name: &str| {
        let out = dir.path().join(name);
        std::fs::create_dir_all(&out).unwrap();
        (stage.run(&unit, &out, &Silent), out)
    };
    let (report, out) = run("out");
    let report = report.unwrap();
    assert!(
        report.line.starts_with("accepted 11.3 s of 13.3 s in 2 intervals, 10 windows of 64 frames"),
        "{}",
        report.line
    );
    assert!(report.line.ends_with("rejected: hand not visible 2.0 s"), "{}", report.line);
    let ledger = Ledger::read(&out.join("ledger.json")).unwrap();
    assert_eq!((ledger.accepted.len(), ledger.rejected.len()), (2, 1));
    let (again, out_again) = run("again");
    again.unwrap();
    for name in ["intervals.json", "ledger.json", "measures.npz"] {
        assert_eq!(std::fs::read(out.join(name)).unwrap(), std::fs::read(out_again.join(name)).unwrap());
    }
    footage.sound = None;
    write(&work, &unit, &footage, "a");
    assert_eq!(stage.inputs(&unit).unwrap().len(), 3);
    let line = run("silent").0.unwrap().line;
    assert!(line.starts_with("no interval accepted in 13.3 s; rejected: no audio 13.3 s (no sound: "), "{line}");
    std::fs::write(work.join("pose2d/host/talk-00000000/keypoints.npz"), "broken").unwrap();
    assert!(format!("{:#}", run("broken").0.unwrap_err()).contains("keypoints.npz"));
}
