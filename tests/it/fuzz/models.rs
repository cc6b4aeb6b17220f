//! Converters of published models to ONNX, one test per source format.

use crate::fixtures::fuzzing::harness::fuzz_bytes;
use crate::fixtures::source_models::run::SourceModel;
use crate::fixtures::source_models::{ncnn_model, tfjs_models, tflite_model};

/// Mutates the file at index `file` of a model.
fn fuzz_model(name: &str, model: &SourceModel, file: usize) {
    let files = [model.files[file].clone()];
    fuzz_bytes(name, &files, |bytes| {
        let mut changed = model.clone();
        changed.files[file] = bytes.to_vec();
        if let Ok(onnx) = changed.convert() {
            let n_bytes: usize = changed.files.iter().map(Vec::len).sum();
            assert!(onnx.len() < 4 * n_bytes + (1 << 20), "{} bytes of {n_bytes}", onnx.len());
        }
    });
}

#[test]
fn tflite() {
    fuzz_model("tflite", &tflite_model::small(), 0);
}

#[test]
fn movenet_tfjs() {
    fuzz_model("movenet_tfjs", &tfjs_models::movenet(), 0);
}

#[test]
fn nanodet_tfjs() {
    fuzz_model("nanodet_tfjs", &tfjs_models::nanodet(), 0);
}

#[test]
fn ncnn() {
    fuzz_model("ncnn", &ncnn_model::small(), 0);
}

#[test]
fn ncnn_weights() {
    fuzz_model("ncnn_weights", &ncnn_model::small(), 1);
}
