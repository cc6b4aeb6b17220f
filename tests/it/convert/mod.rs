//! Published models of other formats to ONNX: each layer kind against plain arithmetic, real files, damaged files.

pub mod damaged;
pub mod ncnn;
pub mod published;
pub mod tfjs;
pub mod tflite;
