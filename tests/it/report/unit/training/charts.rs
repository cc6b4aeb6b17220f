//! Tests of `orator_report::training::charts`.

use orator_report::training::charts::{MAX_POINTS, TrainingLog};
use serde_json::{Value, json};

#[test]
fn the_best_epoch_is_found_and_long_curves_are_thinned() {
    let mut lines: Vec<Value> = (1..=1000).map(|i| json!({"step": 10 * i, "l1": 1.0, "bone": 0.0})).collect();
    for (step, score) in [(5000, 2.0), (7000, 1.5), (10_000, 1.7)] {
        let mean_pose = json!({"l1": 0.8});
        let validation = json!({"score": score, "generator": {"l1": score / 2.0}, "mean_pose": mean_pose});
        lines.push(json!({"step": step, "epoch": 1, "validation": validation}));
    }
    let log = TrainingLog::parse(&lines);
    assert_eq!(log.best.unwrap()["step"], 7000);
    let charts = log.charts();
    let titles: Vec<&str> = charts.iter().map(|chart| chart.title.as_str()).collect();
    assert_eq!(titles, ["L1 error", "Score"]);
    assert!(charts[0].lines[0].points.len() <= MAX_POINTS && charts[0].lines[1].points.len() == 3);
    assert_eq!((charts[0].levels[0].value, charts[0].marked), (0.8, Some(7000.0)));
    assert!(TrainingLog::parse(&[]).charts().is_empty());
}

#[test]
fn the_log_of_a_sequence_network_has_its_curves() {
    let mut lines: Vec<Value> = (1..=9)
        .map(|i| json!({"step": 10 * i, "total": 0.6, "l1": 0.5, "discriminator": 0.0, "gradient_norm": 2.0}))
        .collect();
    let validation = json!({"score": 1.1, "l1": 0.4, "mean_pose_l1": 0.5, "energy": 0.7, "n_segments": 8});
    lines.push(json!({"step": 90, "epoch": 1, "validation": validation}));
    let charts = TrainingLog::parse(&lines).charts();
    let titles: Vec<&str> = charts.iter().map(|chart| chart.title.as_str()).collect();
    assert_eq!(titles, ["L1 error", "Motion energy", "Score", "Gradient norm"]);
    assert_eq!((charts[0].levels[0].value, charts[0].lines[1].points[0]), (0.5, [90.0, 0.4]));
}
