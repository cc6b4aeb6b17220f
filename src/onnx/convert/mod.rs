//! Published models of other formats to ONNX (IR 8, opset 13), without their frameworks: TFLite, TensorFlow.js, ncnn. The
//! same files give the same bytes on every machine. Weights stay the numbers of the source: fp16 is widened by a Cast in
//! the graph. Only the operators of the models in use are known; any other is an error that names it.

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

pub use graph::{AttributeValue, OnnxGraph};
pub use source::{ConversionOptions, SourceFormat, convert};
