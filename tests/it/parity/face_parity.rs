//! The face model, converted by the program, gives the output of the TFLite interpreter on the published file
//! (`fixtures/reference/face_reference.py`): landmarks within 0.001 px at an input size of 192 px.

use crate::fixtures::onnx_models::models;

#[derive(serde::Deserialize)]
struct Golden {
    shown: Vec<usize>,
    noise: FaceValues,
    smooth: FaceValues,
}

#[derive(serde::Deserialize)]
struct FaceValues {
    input_sum: f64,
    score_logit: f32,
    points: Vec<[f32; 3]>,
}

/// Grey level of the smooth test image at a position.
fn smooth(x: f64, y: f64) -> f64 {
    let spot = |cx: f64, cy: f64, rx: f64, ry: f64| (-((x - cx) / rx).powi(2) - ((y - cy) / ry).powi(2)).exp();
    let eyes = spot(70.0, 80.0, 9.0, 6.0) + spot(122.0, 80.0, 9.0, 6.0);
    let grey = 0.8 * spot(96.0, 100.0, 70.0, 90.0) - 0.5 * (eyes + spot(96.0, 135.0, 18.0, 7.0));
    (grey.clamp(0.0, 1.0) * 255.0).floor()
}

#[test]
fn the_face_model_agrees_with_tflite() {
    let Some((store, runtime)) = models() else { return };
    let golden: Golden = serde_json::from_str(include_str!("../../../fixtures/reference/face_golden.json")).unwrap();
    let mut model = store.check(&runtime, store.manifest().get("face-mediapipe").unwrap()).unwrap();
    for (values, is_noise) in [(golden.noise, true), (golden.smooth, false)] {
        for (k, value) in model.input_mut().iter_mut().enumerate() {
            let noise = ((k as u64).wrapping_mul(2_654_435_761) >> 13) & 255;
            let byte = if is_noise { noise as f32 } else { smooth((k / 3 % 192) as f64, (k / 576) as f64) as f32 };
            *value = byte / 255.0;
        }
        let sum: f64 = model.input_mut().iter().map(|value| f64::from(*value)).sum();
        assert!((sum - values.input_sum).abs() < 0.02, "another input image: {sum}, {}", values.input_sum);
        let outputs = model.run().unwrap();
        let (points, score) = (outputs.floats("landmarks").unwrap().1, outputs.floats("face_score_logit").unwrap().1);
        assert!((score[0] - values.score_logit).abs() < 1e-3, "{} {}", score[0], values.score_logit);
        for (at, expected) in golden.shown.iter().zip(&values.points) {
            for (found, expected) in points[3 * at..3 * at + 3].iter().zip(expected) {
                assert!((found - expected).abs() < 1e-3, "point {at}: {found}, expected {expected}");
            }
        }
    }
}
