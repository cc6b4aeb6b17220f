//! Source formats, options for the converted model, and the choice of the converter.

use super::graph::OnnxGraph;
use super::{movenet, nanodet, ncnn, tfjs_file::TfGraph, tflite};
use crate::Port;
use anyhow::{Context, Result, bail, ensure};
use orator_base::text::counted;
use serde::{Deserialize, Serialize};
use std::fmt::{Display, Formatter};

/// Format of published model files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SourceFormat {
    /// One file, used without conversion.
    Onnx,
    /// One flatbuffer with fp32 or fp16 weights.
    Tflite,
    /// The `.json` and `.bin` of a graph model: MoveNet (single pose), to heat-maps, or NanoDet, to person boxes.
    TfjsGraph,
    /// The `.param` and the `.bin` file.
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

/// Inputs and outputs of the converted model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConversionOptions {
    /// Name and shape of the input; the shape must equal that of the source, if the source states it.
    pub input: Port,
    /// Names of the outputs in the order of the source; outputs with an empty name are omitted.
    pub outputs: Vec<String>,
}

impl ConversionOptions {
    /// Shape of the input.
    pub fn shape(&self) -> Result<Vec<usize>> {
        let size = |size: &i64| usize::try_from(*size).ok().filter(|size| (1..=1 << 14).contains(size));
        let sizes: Option<Vec<usize>> = self.input.shape.iter().map(size).collect();
        sizes.with_context(|| {
            format!("the input {:?} has shape {:?}, expected sizes of 1 to 16384", self.input.name, self.input.shape)
        })
    }

    /// Name of the only output.
    pub fn only_output(&self) -> Result<&str> {
        match self.outputs.as_slice() {
            [name] if !name.is_empty() => Ok(name),
            names => bail!("expected 1 output name, not {names:?}"),
        }
    }
}

/// Converts the model in `files`, whose number and order depend on the format, to the contents of an ONNX file.
///
/// # Errors
///
/// The number of files is wrong, or a file is damaged or unsupported; the message names layer and what was expected.
pub fn convert(format: SourceFormat, files: &[&[u8]], options: &ConversionOptions) -> Result<Vec<u8>> {
    let expected = match format {
        SourceFormat::Onnx | SourceFormat::Tflite => 1,
        SourceFormat::TfjsGraph | SourceFormat::Ncnn => 2,
    };
    ensure!(files.len() == expected, "a {format} model needs {}, not {}", counted(expected, "file"), files.len());
    let graph = OnnxGraph::new(files.iter().map(|file| file.len()).sum());
    let result = match (format, files) {
        (SourceFormat::Tflite, [model]) => tflite::convert(model, graph, options),
        (SourceFormat::TfjsGraph, [topology, weights]) => TfGraph::read(topology, weights).and_then(|source| {
            if movenet::is_movenet(&source) {
                return movenet::convert(&source, graph, options);
            }
            ensure!(
                nanodet::is_nanodet(&source),
                "unsupported graph: it has neither the nodes of a MoveNet nor of a NanoDet"
            );
            nanodet::convert(&source, graph, options)
        }),
        (SourceFormat::Ncnn, [parameters, weights]) => ncnn::convert(parameters, weights, graph, options),
        _ => return Ok(files.concat()),
    };
    result.with_context(|| format!("cannot convert the {format} model to ONNX"))
}
