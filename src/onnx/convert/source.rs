//! What can be converted, what the result looks like from outside, and the choice of the converter.

use super::graph::OnnxGraph;
use super::{movenet, nanodet, ncnn, tfjs_file::TfGraph, tflite};
use crate::Port;
use anyhow::{Context, Result, bail, ensure};
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

/// What the result looks like from outside.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConversionOptions {
    /// Name and shape of the input; the shape is that of the source, where the source says it.
    pub input: Port,
    /// Names of the outputs in the order of the source; one with an empty name is left out.
    pub outputs: Vec<String>,
}

impl ConversionOptions {
    /// The sizes of the input. Errors: a size below 1 or above any picture's.
    pub fn shape(&self) -> Result<Vec<usize>> {
        let size = |size: &i64| usize::try_from(*size).ok().filter(|size| (1..=1 << 14).contains(size));
        let sizes: Option<Vec<usize>> = self.input.shape.iter().map(size).collect();
        sizes.with_context(|| {
            format!("the input {:?} needs sizes of 1 to 16384, not {:?}", self.input.name, self.input.shape)
        })
    }

    /// The name of the only output.
    pub fn only_output(&self) -> Result<&str> {
        match self.outputs.as_slice() {
            [name] if !name.is_empty() => Ok(name),
            names => bail!("the model has one output, which needs one name, not {names:?}"),
        }
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
