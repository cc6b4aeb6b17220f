//! Thresholds, sliders and worst videos of the report.

use orator_base::stage::ledger::{Ledger, RejectedInterval};
use orator_base::stage::rejection::{FrameRejection, Rejection};
use orator_base::types::time::FrameRate;
use orator_dataset::config::{self, SegmentConfig};
use orator_formats::media_json::MediaInfo;
use orator_pipeline::segment::Measures;
use orator_report::videos::sliders::{JudgedVideo, open_frames};
use orator_report::videos::thresholds::THRESHOLDS;
use orator_report::videos::worst::Worst;

/// Measures of 300 good frames, except for a jump at frame 200.
fn measures() -> Measures {
    let of = |value: f32| vec![value; 300];
    let mut jump = of(0.0);
    jump[200] = 1.0;
    Measures {
        sound: of(1.0),
        sound_db: of(-20.0),
        speech: of(0.9),
        lip_sync: of(0.9),
        frame_difference: of(5.0),
        person: of(0.9),
        shoulder_px: of(120.0),
        face: of(0.9),
        facing: of(2.0),
        nose_off: of(0.0),
        arms: of(0.9),
        left_hand: of(0.9),
        right_hand: of(0.9),
        left_other: of(0.0),
        right_other: of(0.0),
        rest: of(10.0),
        n_persons: of(1.0),
        jump,
        identity: of(0.0),
        shot_score: of(0.0),
    }
}

#[test]
fn other_thresholds_change_what_is_accepted_and_open_frames_stay_refused() {
    let video = MediaInfo::new(19.99, 300, FrameRate::new(15, 1));
    let (measures, rules) = (measures(), SegmentConfig::default());
    let max_bone_change = 0.4;
    let none = JudgedVideo {
        measures: &measures,
        video: &video,
        bone_change: &[],
        max_bone_change,
        open: &[],
        decisions: &[],
    };
    assert!((none.accepted_secs(&rules) - (19.99 - 1.0 / 15.0)).abs() < 1e-9);
    let why = FrameRejection::new(Rejection::MissingJoints, 3.0, 0.0);
    let rejected = vec![RejectedInterval::new(12.0, 13.0, why), RejectedInterval::new(19.0, 19.99, why)];
    let open = open_frames(&Ledger { rejected, ..Ledger::default() }, &video);
    assert_eq!((open.iter().flatten().count(), open[180].is_some(), open[195].is_some()), (30, true, false));
    let mut bone_change = vec![0.1; 300];
    bone_change[150..165].fill(0.9);
    bone_change[20] = 0.9;
    let some = JudgedVideo { bone_change: &bone_change, open: &open, ..none };
    // Accepted are the frames 0..150 and 201..285; the remaining frames 165..180 and 195..200 are too short.
    assert!((some.accepted_secs(&rules) - (10.0 + 84.0 / 15.0)).abs() < 1e-9);
    let table = some.table(&rules);
    for (threshold, row) in THRESHOLDS.iter().zip(&table) {
        let (grid, at) = threshold.grid(&rules);
        assert_eq!((row.len(), row[at]), (grid.len(), some.accepted_secs(&rules)), "{}", threshold.key);
    }
    let jump = THRESHOLDS.iter().position(|threshold| threshold.key == "max_jump").unwrap();
    assert!((table[jump].last().unwrap() - (10.0 + 90.0 / 15.0)).abs() < 1e-9);
}

#[test]
fn the_worst_frame_of_the_worst_spans_is_chosen() {
    let of = |value: f32| vec![value; 100];
    let mut measures = Measures { person: of(0.9), left_hand: of(0.9), right_hand: of(0.9), ..Measures::default() };
    measures.jump = of(0.1);
    (measures.jump[20], measures.jump[50]) = (0.8, 1.8);
    measures.right_hand[70..90].fill(0.2);
    measures.right_hand[74] = 0.1;
    let span = |start: f64, end: f64, rejection: Rejection, measured: f64| {
        RejectedInterval::new(start, end, FrameRejection::new(rejection, measured, 0.5))
    };
    let rejected = vec![
        span(2.0, 2.1, Rejection::Jump, 0.8),
        span(5.0, 5.1, Rejection::Jump, 1.8),
        span(7.0, 9.0, Rejection::HandGap, 2.0),
        span(9.0, 9.5, Rejection::TooShort, 0.5),
    ];
    let ledger = Ledger { duration_secs: 10.0, rejected, ..Ledger::default() };
    let judged = MediaInfo::new(10.0, 100, FrameRate::new(10, 1));
    let mut worst = Worst::new(1);
    worst.add(0, &ledger, (&measures, &[]), &judged, &SegmentConfig::default());
    let frames: Vec<(&str, Vec<usize>)> =
        worst.rules.iter().map(|((_, reason, _), of)| (reason.as_str(), of[0].frames.clone())).collect();
    assert_eq!(frames, [("hands", vec![74]), ("jump", vec![49, 50]), ("too short", vec![92])]);
    assert_eq!(worst.frames_of(0), [49, 50, 74, 92]);
    worst.add(1, &ledger, (&measures, &[]), &judged, &SegmentConfig::default());
    assert!(worst.frames_of(1).is_empty(), "equal ones: the first video's");
    let mut none = Worst::new(0);
    none.add(0, &ledger, (&measures, &[]), &judged, &SegmentConfig::default());
    assert!(none.rules.is_empty());
}

#[test]
fn every_threshold_can_be_tried_and_every_value_can_be_written() {
    let rules = SegmentConfig::default();
    let fields = serde_json::to_value(&rules).unwrap();
    let numbers = fields.as_object().unwrap().iter().filter(|(_, value)| value.is_number());
    let mut keys: Vec<&str> = numbers.map(|(key, _)| key.as_str()).collect();
    let mut tried = THRESHOLDS.map(|threshold| threshold.key);
    keys.sort_unstable();
    tried.sort_unstable();
    assert_eq!(keys, tried);
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("pipeline.toml");
    for threshold in THRESHOLDS {
        let (grid, at) = threshold.grid(&rules);
        assert!((21..=22).contains(&grid.len()) && grid.is_sorted() && grid[at] == (threshold.get)(&rules));
        for value in grid {
            let line = format!("[segment]\n{} = {}\n", threshold.key, threshold.written(value));
            std::fs::write(&file, line).unwrap();
            let read = config::load(&file, &[]).unwrap().settings.segment;
            assert_eq!(read, threshold.with(&rules, value));
        }
    }
    let odd = SegmentConfig { max_jump: 7.25, ..rules };
    let jump = THRESHOLDS.iter().find(|threshold| threshold.key == "max_jump").unwrap();
    assert_eq!(jump.grid(&odd).0.last(), Some(&7.25));
}
