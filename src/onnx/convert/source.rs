//! What can be converted, and the choice of the converter.

use super::graph::OnnxGraph;
use super::options::ConversionOptions;
use super::{movenet, nanodet, ncnn, tfjs_file::TfGraph, tflite};
use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use std::fmt::{Display, Formatter};

/// The format of published model files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SourceFormat {
    /// One file, taken as it is.
    Onnx,
    /// One flatbuffer, weights fp32 or fp16.
    Tflite,
    /// The `.json` and the `.bin` of a graph model: MoveNet (single pose), to heat-maps, or NanoDet, to boxes of people.
    TfjsGraph,
    /// The `.param` and the `.bin`.
    Ncnn,
}

impl Display for SourceFormat {
    fn fmt(&self, f: &mut Formatter) -> std::fmt::Result {
        f.write_str(match self {
            Self::Onnx => "ONNX",
            Self::Tflite => "TFLite",
            Self::TfjsGraph => "TensorFlow.js",
            Self::Ncnn => "ncnn",
        })
    }
}

/// The model in `files` as the bytes of an ONNX file; how many files, and in which order, the format says. Errors:
/// another number of files, or one that is damaged, or that holds something unknown: the message names the layer and
/// what was expected.
pub fn convert(format: SourceFormat, files: &[&[u8]], options: &ConversionOptions) -> Result<Vec<u8>> {
    let expected = match format {
        SourceFormat::Onnx | SourceFormat::Tflite => 1,
        SourceFormat::TfjsGraph | SourceFormat::Ncnn => 2,
    };
    ensure!(files.len() == expected, "a model of the format {format} has {expected} file(s), not {}", files.len());
    let graph = OnnxGraph::new(files.iter().map(|file| file.len()).sum());
    let result = match (format, files) {
        (SourceFormat::Tflite, [model]) => tflite::convert(model, graph, options),
        (SourceFormat::TfjsGraph, [topology, weights]) => TfGraph::read(topology, weights).and_then(|source| {
            if movenet::is_movenet(&source) {
                return movenet::convert(&source, graph, options);
            }
            ensure!(nanodet::is_nanodet(&source), "neither the nodes of a MoveNet nor those of a NanoDet are in it");
            nanodet::convert(&source, graph, options)
        }),
        (SourceFormat::Ncnn, [parameters, weights]) => ncnn::convert(parameters, weights, graph, options),
        _ => return Ok(files.concat()),
    };
    result.with_context(|| format!("this {format} model cannot be converted to ONNX"))
}
