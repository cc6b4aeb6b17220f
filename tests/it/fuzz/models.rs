//! Published models, each of the formats that are converted.

use crate::fixtures::fuzzing::harness::fuzz_bytes;
use crate::fixtures::source_models::run::SourceModel;
use crate::fixtures::source_models::{ncnn_model, tfjs_models, tflite_model};

/// Changes the file `which` of a model.
fn fuzz_model(name: &str, model: &SourceModel, which: usize) {
    let files = [model.files[which].clone()];
    fuzz_bytes(name, &files, |bytes| {
        let mut changed = model.clone();
        changed.files[which] = bytes.to_vec();
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
fn tfjs_of_movenet() {
    fuzz_model("tfjs_of_movenet", &tfjs_models::movenet(), 0);
}

#[test]
fn tfjs_of_nanodet() {
    fuzz_model("tfjs_of_nanodet", &tfjs_models::nanodet(), 0);
}

#[test]
fn ncnn() {
    fuzz_model("ncnn", &ncnn_model::small(), 0);
}

#[test]
fn weights_of_ncnn() {
    fuzz_model("weights_of_ncnn", &ncnn_model::small(), 1);
}
