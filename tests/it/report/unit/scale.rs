//! Unit tests of `orator_report::html::chart::scale`.

use orator_report::html::chart::scale::{ChartDot, Scale, dots};

#[test]
fn ticks_are_round_and_inside() {
    let ticks = |low, high| Scale { low, high, from: 0.0, to: 100.0 }.ticks(5);
    assert_eq!(ticks(-100.0, 0.0), [-100.0, -80.0, -60.0, -40.0, -20.0, 0.0]);
    assert_eq!(ticks(0.0, 1.0).len(), 6);
    assert_eq!(ticks(3.0, 3.0), [3.0]);
    let scale = Scale { low: 0.0, high: 2.0, from: 10.0, to: 110.0 };
    assert_eq!([1.0, 5.0, -1.0, f64::NAN].map(|v| scale.at(v)), [60.0, 110.0, 10.0, 10.0]);
}

#[test]
fn a_dot_has_its_share_and_description() {
    let dot = |share| ChartDot { at: [3.0, 4.0], share, radius: 2.0, description: "R<Wrist>: 40 %".to_owned() };
    let labels = [([1.0, 1.0], "hand".to_owned())];
    let drawn = dots("a", [9.0, 9.0], &[[[0.0, 0.0], [3.0, 4.0]]], &[dot(0.4), dot(f64::NAN)], &labels).to_string();
    assert!(drawn.contains("--share:40%") && drawn.contains("<title>R&lt;Wrist&gt;: 40 %</title>"), "{drawn}");
    assert!(drawn.contains("share unknown") && drawn.contains("edge"), "{drawn}");
}
