//! Tests of single modules of `orator-onnx`.

mod manifest;
mod runtime;
