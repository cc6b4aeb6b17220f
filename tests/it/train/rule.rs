//! The synthetic speaker with a known rule, by the program: what its dataset must be like before anything is trained on it.
//! That the defaults learn the rule is proved by `make prove-rule`.

use serde_json::Value;
use std::process::Command;

fn answer(args: &[&str]) -> Value {
    let output = Command::new(env!("CARGO_BIN_EXE_orator")).args(args).arg("--json").output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn neither_the_mean_pose_nor_the_sound_of_the_moment_explains_the_gestures() {
    let dir = tempfile::tempdir().unwrap();
    let data = dir.path().join("data").to_string_lossy().into_owned();
    answer(&["demo", "speaker", &data, "--hours", "0.1", "--seed", "3"]);
    let measured = answer(&["demo", "learned", "--dataset", &data]);
    let row = |name: &str| {
        let rows = measured["rows"].as_array().unwrap();
        rows.iter().find(|row| row["predictor"] == name).unwrap_or_else(|| panic!("no {name}: {measured}")).clone()
    };
    let number = |row: &Value, path: &str| row.pointer(path).and_then(Value::as_f64).unwrap();
    let mean_pck = number(&row("mean pose"), "/poses/pck");
    assert!((0.2..0.45).contains(&mean_pck), "{mean_pck}");
    for ridge in ["ridge of the frame, to speeds", "ridge of the frame, to poses"] {
        for hand in ["/speed_correlation/0", "/speed_correlation/1"] {
            assert!(number(&row(ridge), hand) < 0.5, "{ridge}: {measured}");
        }
    }
    let rule = row("the rule without variation");
    assert!(number(&rule, "/poses/pck") > 0.7 && number(&rule, "/speed_correlation/0") > 0.999, "{rule}");
    let data = row("the data itself");
    assert!((number(&data, "/poses/energy") - 1.0).abs() < 1e-9 && number(&data, "/poses/l1") == 0.0, "{data}");
    assert!(number(&data, "/speed_correlation/1") < 0.95, "without variation there is nothing to tell apart: {data}");
}
