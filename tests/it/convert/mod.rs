//! Conversion of published models to ONNX: each layer kind against plain arithmetic, real files, damaged files.

pub(crate) mod damaged;
pub(crate) mod ncnn;
pub(crate) mod published;
pub(crate) mod tfjs;
pub(crate) mod tflite;
pub(crate) mod unit;
