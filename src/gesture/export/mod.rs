//! Trained generators as ONNX files (`orator generate --export`), for other programs and for browsers: a front end from
//! samples to the network's input, and the network up to joints in metres. Operators of opset 13 without control flow.

mod cepstra;
mod file;
mod gan;
mod graph;
mod joints;
mod mels;
mod sequence;

pub use file::export;
