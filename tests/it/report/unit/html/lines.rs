//! Tests of `orator_report::html::chart::lines`.

use orator_report::html::chart::lines::{ChartLevel, ChartLine, LineChart, curve};

#[test]
fn lines_levels_and_the_marked_step_are_drawn() {
    let points = vec![[0.0, 4.0], [50.0, f64::NAN], [100.0, 2.0]];
    let chart = LineChart {
        title: "A < b".to_owned(),
        lines: vec![ChartLine { name: "generated".to_owned(), colour: 0, points }],
        levels: vec![ChartLevel { name: "mean pose".to_owned(), colour: 1, value: 1.0 }],
        marked: Some(100.0),
        ..LineChart::default()
    };
    assert_eq!(chart.ranges(), [[0.0, 100.0], [0.0, 4.0]]);
    let drawn = chart.card().to_string();
    assert!(drawn.contains("d=\"M44 12 L350 86\""), "{drawn}");
    assert!(drawn.contains("y1=\"123\" x2=\"350\" y2=\"123\"") && drawn.contains("A &lt; b"), "{drawn}");
    let empty = LineChart::default();
    assert!(empty.is_empty() && empty.card().to_string().contains("<svg") && !chart.is_empty());
    assert_eq!(empty.ranges(), [[0.0, 1.0], [0.0, 1.0]]);
}

#[test]
fn the_marked_step_is_on_the_line() {
    let drawn = curve("", &[0.0, 5.0, 10.0], 10.0, 1).to_string();
    assert!(drawn.contains("cx=\"150\" cy=\"28\"") && drawn.contains("data-xs=\"8 150 292\""), "{drawn}");
    assert!(curve("", &[], 0.0, 3).to_string().contains("<svg"));
}
