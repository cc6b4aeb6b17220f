//! Forest plots.

use orator_report::html::chart::forest::{ForestRow, ForestScale, ValueRange, forest, ranges};

#[test]
fn rows_lie_on_the_scale() {
    let row = |name: &str, value, interval| ForestRow {
        name: name.to_owned(),
        class: "a",
        value,
        interval,
        value_text: "50 %".to_owned(),
    };
    let rows = [row("<all>", 50.0, Some([40.0, 60.0])), row("b", 75.0, None)];
    let scale = ForestScale { low: 0.0, high: 100.0, middle: Some(50.0), band: Some([40.0, 60.0]), unit: "%" };
    let drawn = forest("shares", &rows, &scale).to_string();
    assert_eq!((drawn.matches("class=\"range\"").count(), drawn.matches("class=\"point\"").count()), (3, 2));
    assert!(drawn.contains("&lt;all&gt;") && drawn.contains("x=\"362\"") && drawn.contains("cx=\"395\""), "{drawn}");
    assert!(forest("", &[], &scale).to_string().contains("<svg"));
}

#[test]
fn a_row_without_a_measurement_is_labelled() {
    let row = |marks| ValueRange { name: "wrist".into(), class: "left", marks };
    let rows = [row([-0.5, -0.2, 0.0, 0.3, 0.6]), row([f64::NAN; 5])];
    let drawn = ranges("", &rows, [-1.0, 1.0], ["left", "right"]).to_string();
    assert_eq!(drawn.matches("class=\"box left\"").count(), 1);
    assert!(drawn.contains("not measured"));
}
