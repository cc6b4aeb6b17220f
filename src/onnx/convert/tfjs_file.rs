//! The two files of a TensorFlow.js graph model: nodes in JSON, and the concatenated constants.

use super::graph::ElementType;
use super::layout::{MAX_SIZE, int32s, size};
use anyhow::{Context, Result, bail, ensure};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use orator_base::text::counted;
use serde_json::Value;
use std::collections::BTreeMap;

/// A constant: shape and little-endian numbers.
#[derive(Clone, Debug)]
pub(crate) struct TfTensor<'a> {
    pub element: ElementType,
    pub shape: Vec<usize>,
    pub raw: &'a [u8],
}

#[derive(Clone, Debug)]
pub(crate) struct TfNode {
    pub op: String,
    pub inputs: Vec<String>,
    attributes: Value,
}

#[derive(Clone, Debug)]
pub(crate) struct TfGraph<'a> {
    pub nodes: BTreeMap<String, TfNode>,
    pub tensors: BTreeMap<String, TfTensor<'a>>,
}

impl<'a> TfGraph<'a> {
    /// Reads the graph in the JSON `topology`, with its constants in `weights`. Errors: the JSON has another
    /// structure, or the total length of the constants is not that of `weights`.
    pub(crate) fn read(topology: &[u8], weights: &'a [u8]) -> Result<Self> {
        let json: Value = serde_json::from_slice(topology).context("the first file is not JSON")?;
        let (mut tensors, mut rest) = (BTreeMap::new(), weights);
        for tensor in list(&json, "/weightsManifest")?.iter().map(|group| list(group, "/weights")) {
            for tensor in tensor? {
                let name = text(tensor, "/name")?;
                let (tensor, after) = read_tensor(tensor, rest).with_context(|| format!("constant {name:?}"))?;
                tensors.insert(name.to_owned(), tensor);
                rest = after;
            }
        }
        ensure!(rest.is_empty(), "{} of the second file belong to no constant", counted(rest.len(), "byte"));
        let mut nodes = BTreeMap::new();
        for node in list(&json, "/modelTopology/node")? {
            let inputs = node.get("input").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
            let inputs: Option<Vec<String>> = inputs.iter().map(|input| Some(input.as_str()?.to_owned())).collect();
            let name = text(node, "/name")?;
            let inputs = inputs.with_context(|| format!("node {name:?} has an input without a name"))?;
            let attributes = node.get("attr").cloned().unwrap_or_default();
            nodes.insert(name.to_owned(), TfNode { op: text(node, "/op")?.to_owned(), inputs, attributes });
        }
        Ok(Self { nodes, tensors })
    }

    pub(crate) fn tensor(&self, name: &str) -> Result<&TfTensor<'a>> {
        self.tensors.get(name).with_context(|| format!("missing constant {name:?}"))
    }

    /// Shape of the only input of the graph.
    pub(crate) fn input_shape(&self) -> Result<Vec<usize>> {
        let (_, input) = self.input()?;
        let sizes = list(&input.attributes, "/shape/shape/dim")?;
        sizes.iter().map(|dim| size(integer(dim.get("size").unwrap_or(dim))?)).collect()
    }

    /// Name and node of the only input of the graph.
    pub(crate) fn input(&self) -> Result<(&str, &TfNode)> {
        let mut inputs = self.nodes.iter().filter(|(_, node)| node.op == "Placeholder");
        match (inputs.next(), inputs.next()) {
            (Some((name, node)), None) => Ok((name, node)),
            _ => bail!("expected 1 node of type Placeholder (the input)"),
        }
    }
}

impl TfTensor<'_> {
    /// Values of a scalar or 1-D constant of 32-bit integers. Errors: another element type, or more than 64 values.
    pub(crate) fn integers(&self) -> Result<Vec<i64>> {
        ensure!(self.element == ElementType::I32 && self.raw.len() <= 256, "expected at most 64 values of type int32");
        Ok(int32s(self.raw).map(i64::from).collect())
    }
}

impl TfNode {
    pub(crate) fn integers(&self, name: &str) -> Result<Vec<i64>> {
        list(&self.attributes, &format!("/{name}/list/i"))?.iter().map(integer).collect()
    }

    pub(crate) fn text(&self, name: &str) -> Result<String> {
        decode(self.attributes.pointer(&format!("/{name}/s")).with_context(|| format!("missing attribute {name:?}"))?)
    }

    /// Attribute with a list of strings; empty if absent.
    pub(crate) fn texts(&self, name: &str) -> Result<Vec<String>> {
        let texts = self.attributes.pointer(&format!("/{name}/list/s")).and_then(Value::as_array);
        texts.map_or(&[][..], Vec::as_slice).iter().map(decode).collect()
    }

    /// Boolean attribute; false if absent.
    pub(crate) fn is(&self, name: &str) -> bool {
        self.attributes.pointer(&format!("/{name}/b")).and_then(Value::as_bool).unwrap_or(false)
    }

    pub(crate) fn number(&self, name: &str) -> Result<f32> {
        let number = self.attributes.pointer(&format!("/{name}/f")).and_then(Value::as_f64);
        Ok(number.with_context(|| format!("missing attribute {name:?}"))? as f32)
    }
}

/// Reads a constant at the start of `rest` and returns the remaining bytes.
fn read_tensor<'a>(described: &Value, rest: &'a [u8]) -> Result<(TfTensor<'a>, &'a [u8])> {
    let quantized = described.pointer("/quantization/dtype").map(|kind| kind.as_str().unwrap_or("unknown"));
    let element = match (text(described, "/dtype")?, quantized) {
        ("float32", Some("float16")) => ElementType::F16,
        ("float32", None) if described.get("quantization").is_none() => ElementType::F32,
        ("int32", None) if described.get("quantization").is_none() => ElementType::I32,
        (kind, quantized) => {
            let stored = quantized.map(|stored| format!(" quantized to {stored}")).unwrap_or_default();
            bail!("unsupported type {kind}{stored}: expected float16, float32 or int32")
        }
    };
    let shape = list(described, "/shape")?.iter().map(integer).collect::<Result<Vec<_>>>()?;
    ensure!(shape.len() <= 6 && shape.iter().all(|dim| (0..=MAX_SIZE as i64).contains(dim)), "invalid shape {shape:?}");
    let shape: Vec<usize> = shape.into_iter().map(|dim| dim as usize).collect();
    let n_bytes = shape.iter().try_fold(element.n_bytes(), |product: usize, dim| product.checked_mul(*dim));
    let (raw, after) = n_bytes
        .and_then(|n_bytes| rest.split_at_checked(n_bytes))
        .with_context(|| format!("the second file ends inside this constant of shape {shape:?}"))?;
    Ok((TfTensor { element, shape, raw }, after))
}

fn list<'j>(json: &'j Value, pointer: &str) -> Result<&'j [Value]> {
    let found = json.pointer(pointer).and_then(Value::as_array);
    Ok(found.with_context(|| format!("expected a list at {pointer}"))?)
}

fn text<'j>(json: &'j Value, pointer: &str) -> Result<&'j str> {
    json.pointer(pointer).and_then(Value::as_str).with_context(|| format!("expected a string at {pointer}"))
}

/// Reads an integer, which may be given as a string.
fn integer(json: &Value) -> Result<i64> {
    let number = json.as_i64().or_else(|| json.as_str()?.parse().ok());
    number.with_context(|| format!("expected an integer, not {json}"))
}

/// Decodes a Base64 string.
fn decode(json: &Value) -> Result<String> {
    let bytes = json.as_str().and_then(|text| STANDARD.decode(text).ok());
    let decoded = bytes.and_then(|bytes| String::from_utf8(bytes).ok());
    decoded.with_context(|| format!("expected a Base64 string, not {json}"))
}
