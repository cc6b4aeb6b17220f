//! The synthetic speaker with a known rule, through the program: properties that its dataset must have before training.
//! `make prove-rule` checks that the defaults learn the rule.

use orator_base::types::sound::Sound;
use orator_formats::wav;
use serde_json::Value;
use std::process::Command;

fn answer(args: &[&str]) -> Value {
    let output = Command::new(env!("CARGO_BIN_EXE_orator-lab")).args(args).arg("--json").output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn neither_the_mean_pose_nor_the_current_audio_frame_explains_the_gestures() {
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
    for ridge in ["ridge, 1 frame of audio, speeds", "ridge, 1 frame of audio, poses"] {
        for hand in ["/speed_correlation/0", "/speed_correlation/1"] {
            assert!(number(&row(ridge), hand) < 0.5, "{ridge}: {measured}");
        }
    }
    let rule = row("rule without variation");
    assert!(number(&rule, "/poses/pck") > 0.7 && number(&rule, "/speed_correlation/0") > 0.999, "{rule}");
    let truth = row("ground truth");
    assert!((number(&truth, "/poses/energy") - 1.0).abs() < 1e-9 && number(&truth, "/poses/l1") == 0.0, "{truth}");
    assert!(number(&truth, "/speed_correlation/1") < 0.95, "the data has no variation: {truth}");
}

/// Recorded speech with word times gets gestures by the second rule, which can be recomputed from the dataset alone.
#[test]
fn recorded_speech_gets_gestures_by_the_second_rule() {
    let dir = tempfile::tempdir().unwrap();
    let speech = dir.path().join("speech");
    std::fs::create_dir(&speech).unwrap();
    for (n, split) in ["train", "train", "validation", "test", "test"].into_iter().enumerate() {
        let rate = 16_000u32;
        // Syllables of a fifth of a second in phrases of two, of which some are loud.
        let loudness = |secs: f64| {
            let syllable = (secs / 0.2) as usize;
            let is_loud = (syllable * 7 + n).is_multiple_of(5);
            if secs % 2.5 < 2.0 && secs % 0.2 < 0.15 { if is_loud { 0.7 } else { 0.2 } } else { 0.0 }
        };
        let times = (0..12 * rate).map(|i| f64::from(i) / f64::from(rate));
        let samples = times.map(|t| (loudness(t) * (t * 1_500.0).sin()) as f32).collect();
        wav::write(&speech.join(format!("{split}-{n}.wav")), &Sound { rate, samples }).unwrap();
        let row = |k: u32| format!("{}\t{}\triver\n", 2 * k, 2.0 * f64::from(k) + 0.3);
        let rows: String = (0..5).map(row).collect();
        std::fs::write(speech.join(format!("{split}-{n}.tsv")), rows).unwrap();
    }
    let path = |name: &str| dir.path().join(name).to_string_lossy().into_owned();
    let spoken = answer(&["demo", "speaker", &path("data"), "--speech", &path("speech"), "--seed", "4"]);
    assert_eq!(spoken["clips"], 5);
    let measured = answer(&["demo", "learned", "--dataset", &path("data")]);
    let correlation = |name: &str, hand: usize| {
        let rows = measured["rows"].as_array().unwrap();
        rows.iter().find(|row| row["predictor"] == name).unwrap()["speed_correlation"][hand].as_f64().unwrap()
    };
    for hand in 0..2 {
        assert!(correlation("rule without variation", hand) > 0.999, "{measured}");
        let of_data = correlation("ground truth", hand);
        assert!((0.4..0.98).contains(&of_data), "{of_data}: {measured}");
    }
    let again = answer(&["demo", "speaker", &path("again"), "--speech", &path("speech"), "--seed", "4"]);
    let sums = |name: &str| std::fs::read(dir.path().join(name).join("checksums.b3")).unwrap();
    assert!(again["clips"] == 5 && sums("data") == sums("again"));

    std::fs::remove_file(speech.join("test-4.tsv")).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_orator-lab"));
    let output = command.args(["demo", "speaker", &path("third"), "--speech", &path("speech")]).output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && errors.contains("test-4.tsv"), "{errors}");
}
