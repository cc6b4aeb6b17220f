//! Tests of `orator_report::html::chart::timeline`.

use orator_report::html::chart::timeline::{TimelineSpan, Track, timeline, tracks};

#[test]
fn every_interval_is_drawn_and_very_many_are_merged() {
    let of = |n: usize| {
        let one = |i: usize| TimelineSpan {
            start_secs: i as f64,
            end_secs: (i + 1) as f64,
            class: format!("c{}", i % 2),
            word: String::new(),
            description: "<one>".to_owned(),
        };
        timeline("a \"b\"", n as f64, &(0..n).map(one).collect::<Vec<_>>(), 500).to_string()
    };
    assert_eq!(of(10).matches("<li").count(), 10);
    assert!(of(10).contains("left:90.000%;width:10.000%") && of(10).contains("title=\"&lt;one&gt;\""));
    let many = of(100_000);
    assert!(many.matches("<li").count() <= 1001 && many.contains("short intervals, the longest"));
    assert_eq!(timeline("", 0.0, &[], 9).to_string().matches("<li").count(), 0);
}

#[test]
fn lines_have_gaps_and_marks_are_in_their_track() {
    let track = Track {
        name: "height <m>".to_owned(),
        lines: vec![("predicted", vec![[0.0, 1.0], [1.0, 2.0], [2.0, f64::NAN], [3.0, 1.0], [4.0, 2.0]])],
        marks: vec![("onset", vec![2.0])],
    };
    let drawn = tracks("a", 4.0, &[track.clone(), Track { lines: Vec::new(), ..track }]).to_string();
    assert!(drawn.contains("M4 86 L182 22 M538 86 L716 22"), "{drawn}");
    assert!(drawn.contains("height &lt;m&gt;") && drawn.matches("moment onset").count() == 2, "{drawn}");
    assert!(tracks("", 0.0, &[]).to_string().contains("<svg"));
}
