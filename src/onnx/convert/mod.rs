//! Converts published models from TFLite, TensorFlow.js and ncnn to ONNX (IR 8, opset 13), without their frameworks.
//! The output bytes depend only on the input files. Weights retain the values of the source; fp16 is widened by a Cast
//! in the graph. Only the operators of the supported models are implemented; any other is an error that names it.

mod flatbuffer;
mod graph;
mod layout;
mod movenet;
mod nanodet;
mod ncnn;
mod ncnn_file;
mod protobuf;
mod source;
mod tfjs;
mod tfjs_file;
mod tflite;

pub(crate) use graph::BATCH;
pub use graph::{AttributeValue, ElementType, GraphPort, OnnxGraph};
pub use source::{ConversionOptions, SourceFormat, convert};
