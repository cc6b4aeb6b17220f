//! Outputs of every ONNX model agree with its recorded values.

use crate::fixtures::onnx_models::models;
use orator_onnx::{Manifest, Model, ModelRole, TensorAxes};
use orator_test_support::skip::real_data;
use std::path::Path;

/// Models whose values were recorded from a file of the same weights under another name.
const RECORDED_AS: [(&str, &str); 4] = [
    ("body-tinypose-256x192", "body_pp_tinypose_256x192.onnx"),
    ("hand-mediapipe-lite", "mp_hand_landmark_lite_224.onnx"),
    ("palm-mediapipe-full", "mp_palm_detection_full_192.onnx"),
    ("face-mediapipe", "mp_face_landmark_192.onnx"),
];

#[test]
fn every_model_gives_its_golden_values() {
    let (Some((store, runtime)), Some(golden)) = (models(), real_data("models/golden.json")) else { return };
    let golden = std::fs::read_to_string(golden).unwrap();
    let golden: serde_json::Value = serde_json::from_str(&golden).unwrap();
    let close = |found: f64, expected: f64| (found - expected).abs() <= 1e-3_f64.max(1e-4 * expected.abs());
    let mut n_checked = 0;
    for entry in &Manifest::builtin().unwrap().models {
        let recorded_name =
            RECORDED_AS.iter().find(|(id, _)| *id == entry.id).map_or(entry.file.as_str(), |(_, file)| file);
        let Some(expected) = golden.get(recorded_name) else { continue };
        let mut model = store.check(&runtime, entry).unwrap();
        for (k, value) in model.input_mut().iter_mut().enumerate() {
            let byte = ((k as u64).wrapping_mul(2_654_435_761) >> 13) & 255;
            *value = match (entry.role, entry.picture.axes) {
                _ if entry.id.contains("yolox") => byte as f32,
                (_, TensorAxes::Nchw) => ((byte as f64 / 255.0 - 0.45) / 0.225) as f32,
                _ if entry.id == "pose-detection-mediapipe" => (byte as f64 / 127.5 - 1.0) as f32,
                _ => (byte as f64 / 255.0) as f32,
            };
        }
        let outputs = model.run().unwrap();
        for (name, expected) in expected["outputs"].as_object().unwrap() {
            let (shape, values) = match outputs.floats(name) {
                Ok((shape, values)) => (shape, values.iter().map(|n| f64::from(*n)).collect::<Vec<_>>()),
                Err(_) => {
                    let (shape, values) = outputs.integers(name).unwrap();
                    (shape, values.iter().map(|n| *n as f64).collect())
                }
            };
            let label = format!("{} {name}", entry.id);
            assert_eq!(serde_json::json!(shape), expected["shape"], "{label}");
            for (found, expected) in values.iter().zip(expected["first8"].as_array().unwrap()) {
                assert!(close(*found, expected.as_f64().unwrap()), "{label}: {found} {expected}");
            }
            let (mut sum, mut largest) = (0.0, (0.0, 0));
            for (k, value) in values.iter().enumerate() {
                sum += value;
                largest = if value.abs() > largest.0 { (value.abs(), k) } else { largest };
            }
            assert!(close(sum, expected["sum"].as_f64().unwrap()), "{label}: sum {sum} {}", expected["sum"]);
            assert!(close(largest.0, expected["absmax"].as_f64().unwrap()), "{label}: absmax {}", largest.0);
        }
        n_checked += 1;
    }
    assert_eq!(n_checked, golden.as_object().unwrap().len());
}

#[test]
fn missing_damaged_and_mismatched_models_have_clear_errors() {
    let Some((store, runtime)) = models() else { return };
    let entry = store.manifest().get_as("hand-mediapipe-lite", ModelRole::Hand).unwrap();
    let empty = tempfile::tempdir().unwrap();
    let message = |entry, dir: &Path| Model::open(&runtime, entry, dir).err().map(|error| error.to_string()).unwrap();
    let missing = message(entry, empty.path());
    assert!(
        missing.contains("missing") && missing.contains(&entry.file) && missing.contains("models fetch"),
        "{missing}"
    );

    std::fs::write(empty.path().join(&entry.file), b"not these bytes").unwrap();
    let damaged = message(entry, empty.path());
    assert!(damaged.contains("sha256") && damaged.contains(&entry.sha256), "{damaged}");

    let mut junk = entry.clone();
    junk.sha256 = orator_onnx::sha256_of(&empty.path().join(&entry.file)).unwrap();
    assert!(message(&junk, empty.path()).contains("ONNX Runtime cannot open"));

    let mut narrow = entry.clone();
    narrow.outputs[0].shape = vec![1, 21];
    let layout = message(&narrow, store.dir());
    assert!(layout.contains("[1, 21]") && layout.contains("[1, 63]") && layout.contains("landmarks"), "{layout}");
    let mut renamed = entry.clone();
    renamed.inputs[0].name = "picture".into();
    assert!(message(&renamed, store.dir()).contains("picture"));
}
